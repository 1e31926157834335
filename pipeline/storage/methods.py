"""Show what the methods of an experiment cost, and how far their references are from samples and truth."""

from collections.abc import Mapping
from typing import Any

from pipeline.storage.results import Results
from pipeline.storage.tables import Table
from trackably.files import read_json
from trackably.learning.learned import LearnedReference
from trackably.learning.problem import ActiveBound

_COSTS = {"nlml": "l", "objective": "J", "price": "price"}
_ERRORS = {"misfit": "misfit", "rmse": "error to the truth", "held_out": "error on held-out samples"}


def table_of_methods(results: Results) -> Table:
    """Return l, J, the price, root mean square errors and whether there is a proof, for each method."""
    metrics: Any = read_json(results.metrics)
    first = next(iter(metrics.values()))
    errors = {
        key: _heading(key, kind) for kind in _ERRORS for key in first if key == kind or key.startswith(f"{kind}_")
    }
    columns = _COSTS | errors
    rows = [
        [method, *(found[key] for key in columns), found["proof"].startswith("proved")]
        for method, found in metrics.items()
    ]
    return Table(["", *columns.values(), "proved"], rows, digits=4)


def _heading(key: str, kind: str) -> str:
    name = key.removeprefix(kind).removeprefix("_")
    return f"{_ERRORS[kind]}, {name}" if name else _ERRORS[kind]


def table_of_hyperparameters(learned: Mapping[str, LearnedReference]) -> Table:
    """Return what each method learned, and k̄ at the end of Algorithm 1 where it was run."""
    names = next(iter(learned.values())).prior.hyperparameters
    rows: list[list[object]] = [
        [name, *(found.prior.hyperparameters[name] for found in learned.values())] for name in names
    ]
    steps = [found.final_step for found in learned.values()]
    if any(step is not None for step in steps):
        rows.append(["last step k̄ of Algorithm 1", *steps])
    return Table(["", *learned], rows)


def table_of_bounds(active: tuple[ActiveBound, ...]) -> Table:
    """Return the bounds that hold a reference back, with their times and what each costs, in the order of time."""
    ordered = sorted(active, key=lambda bound: (bound.time, bound.name))
    rows = [[bound.name, bound.side, bound.time, bound.multiplier, bound.price] for bound in ordered]
    return Table(["bound of", "side", "t [s]", "multiplier", "price"], rows, digits=4)
