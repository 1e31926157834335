"""Sentences and tables about the results of an experiment, for notebooks and pages; they follow from the results."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, cast

from pipeline.margins import MarginProfile
from pipeline.methods import LearnedReference
from pipeline.storage.archive import Fitted
from pipeline.storage.results import Results
from pipeline.theorem import THEORY, proved_by_coq
from trackably.files import read_json
from trackably.learning.problem import ActiveBound
from trackably.reference.fit import edges_of
from trackably.reference.truth import Accuracy
from trackably.systems.constrained import ConstrainedSystem

UNCONSTRAINED = "unconstrained"


class Told(str):
    """A text that notebooks show as Markdown."""

    __slots__ = ()

    _repr_markdown_ = str.__str__

    @classmethod
    def points(cls, sentences: Iterable[str]) -> Self:
        """Return a list with one point for each sentence."""
        return cls("\n".join(f"- {sentence}" for sentence in sentences))


def pictures(results: Results, *names: str) -> Told:
    """Show those of the named figures that the stage `figures` has drawn, in a notebook of the folder `notebooks`."""
    drawn = (results.figure(name) for name in names)
    return Told("\n\n".join(f"![{figure.stem}](../{figure})" for figure in drawn if figure.exists()))


def told_of_system(plant: ConstrainedSystem) -> Told:
    """Name the states, the inputs, the sampling time and the bounds of a plant."""
    system = plant.system
    bounds = _listed(f"{quantity.name} in {quantity.bounds}" for quantity in plant.quantities)
    return Told(
        f"States: {', '.join(system.states)}. Inputs: {', '.join(system.inputs)}, a new one every "
        f"{plant.sampling_time:g} s. Bounds: {bounds}."
    )


def told_of_unconstrained(margins: Mapping[str, list[MarginProfile]]) -> Told:
    """Say which bounds the unconstrained posterior mean breaks, by how much and when; or that it breaks none."""
    profiles = margins[UNCONSTRAINED]
    broken = [
        f"{profile.quantity.name} leaves its bounds by {-worst:.3g} at t = {time:.4g} s"
        for profile in profiles
        for worst, time in [profile.worst]
        if worst < 0
    ]
    if not broken:
        return Told("The unconstrained mean keeps all bounds at all times that were looked at: no constraint is felt.")
    part = len({row for profile in profiles for row in profile.violated}) / len(profiles[0].at_steps)
    return Told(
        f"The system cannot follow the unconstrained mean: {_listed(broken)}. Bounds are broken during "
        f"{100 * part:.2g} % of the time."
    )


def told_of_edges(fitted: Fitted) -> Told:
    """Name the learned hyperparameters at an end of their search interval, as a wider one may have other optima."""
    found = [
        f"- `{method}`: {edge}, {edge.interval}{'' if edge.is_given else ', which was chosen from the samples'}."
        for method, learned in fitted.learned.items()
        for edge in edges_of(learned.prior, fitted.sampled.samples)
    ]
    if not found:
        return Told("Every learned hyperparameter lies inside of its search interval.")
    return Told("\n".join([*found, "", "A wider interval may lead to other hyperparameters there."]))


def told_of_centres(results: Results) -> Told:
    """Say how many kernel centres represent the samples of each name, where they are fewer than the samples."""
    fewer = _read(results.metrics)[UNCONSTRAINED].get("condensed", {})
    said = (f"`{name}`: {of['centres']} centres represent {of['samples']} samples." for name, of in fewer.items())
    return Told.points(said) if fewer else Told("Each sample is a kernel centre.")


def told_of_proofs(results: Results) -> Told:
    """Say for each method what is proved about its reference, what refutes it, or what a proof lacks."""
    return Told.points(f"`{name}`: {found['proof']}" for name, found in _read(results.metrics).items())


def told_of_theorems(results: Results, theory: Path = THEORY) -> Told:
    """Say which certificates are proved by Coq, with the SHA-256 of each statement; empty if Coq proved none."""
    proved = proved_by_coq(results, theory)
    if not proved:
        return Told("")
    versions = _listed(sorted({one.coq for one in proved.values()}))
    files: list[Any] = [read_json(results.certificate(name)) for name in proved]
    silent = {
        "evaluation in float64": True,
        "distances from true signals": any("truth" in file for file in files),
        "plants that differ from their model": any("model" in file.get("disturbance", ()) for file in files),
    }
    but = f"but for {_listed([what for what, left_out in silent.items() if left_out])}"
    begun = f"What these files state, {but}, is a theorem, checked by Coq {versions}. Of each statement the SHA-256:"
    each = (f"- `{name}`, `{'` and `'.join(of.theorems.values())}`: `{of.statement}`" for name, of in proved.items())
    return Told("\n".join((begun, "", *each)))


def printed_by_coq(results: Results, method: str, theory: Path = THEORY) -> str:
    """Return the theorem of a method's certificate as Coq prints it, with the definitions of its words."""
    proved = proved_by_coq(results, theory).get(method)
    if proved is None:
        return "The certificate that is there now is not checked by Coq: `make theorem` lets it."
    return f"{proved.printed}\n\nchecked by Coq {proved.coq}; the statement has the SHA-256 {proved.statement}"


def told_of_truth(results: Results) -> Told:
    """Say how far each proved reference and its plant are from every true signal, and the least possible distance."""
    said = (
        f"`{method}`: {name} is {Accuracy(**of)}."
        for method, found in _read(results.metrics).items()
        for name, of in found.get("accuracy", {}).items()
    )
    return Told.points(said)


def _by_start(counted: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the name of each reference of undisturbed loops, with the metrics by initial state."""
    for reference, of in counted.items():
        if reference not in ("horizon", "online", "tightness", "disturbed", "price_of_room"):
            yield reference, {start: found for start, found in of.items() if isinstance(found, Mapping)}


def _read(path: Path) -> dict[str, Any]:
    return cast(dict[str, Any], read_json(path))


def _listed(parts: Iterable[str]) -> str:
    *others, last = parts
    return f"{', '.join(others)} and {last}" if others else last


@dataclass(frozen=True)
class Table:
    """Rows of text and numbers under column names; floats are shown with `digits` significant digits."""

    columns: Sequence[str]
    rows: Sequence[Sequence[object]]
    digits: int = 6

    def _repr_markdown_(self) -> str:
        lines = [self.columns, ["---"] * len(self.columns), *([self._cell(v) for v in row] for row in self.rows)]
        return "\n".join("| " + " | ".join(line) + " |" for line in lines)

    __str__ = _repr_markdown_

    def _cell(self, value: object) -> str:
        match value:
            case None:
                return "–"
            case bool():
                return "yes" if value else "no"
            case float():
                return f"{value:.{self.digits}g}"
        return str(value)


_COSTS = {"nlml": "l", "objective": "J", "price": "price"}
_HEADINGS = {"misfit": "misfit", "rmse": "error to the truth", "held_out": "error on held-out samples"}


def _table(first: str, columns: Mapping[str, str], rows: Mapping[str, Mapping[str, Any]], digits: int) -> Table:
    """Return a row for each name, with those of its values that `columns` have, under their headings."""
    listed = [[name, *(found.get(key) for key in columns)] for name, found in rows.items()]
    return Table([first, *columns.values()], listed, digits)


def table_of_methods(results: Results) -> Table:
    """Return l, J, the price, root mean square errors and whether there is a proof, for each method.

    l is the negative log marginal likelihood, and J is l plus the cost of active bounds.
    """
    metrics = _read(results.metrics)
    first = next(iter(metrics.values()))
    errors = {
        key: _heading(key, kind) for kind in _HEADINGS for key in first if key == kind or key.startswith(f"{kind}_")
    }
    rows = {method: {**found, "is_proved": found["proof"].startswith("proved")} for method, found in metrics.items()}
    return _table("", {**_COSTS, **errors, "is_proved": "proved"}, rows, digits=4)


def _heading(key: str, kind: str) -> str:
    name = key.removeprefix(kind).removeprefix("_")
    return f"{_HEADINGS[kind]}, {name}" if name else _HEADINGS[kind]


def table_of_hyperparameters(learned: Mapping[str, LearnedReference]) -> Table:
    """Return the hyperparameters that each method learned, and for Algorithm 1 its last k̄."""
    names = next(iter(learned.values())).prior.hyperparameters
    rows: list[list[object]] = [
        [name, *(found.prior.hyperparameters[name] for found in learned.values())] for name in names
    ]
    steps = [found.final_step for found in learned.values()]
    if any(step is not None for step in steps):
        rows.append(["last step k̄ of Algorithm 1", *steps])
    return Table(["", *learned], rows)


def table_of_bounds(active: tuple[ActiveBound, ...]) -> Table:
    """Return the active bounds of a reference in the order of time, with what each of them costs."""
    ordered = sorted(active, key=lambda bound: (bound.time, bound.name))
    rows = [[bound.name, bound.side, bound.time, bound.multiplier, bound.price] for bound in ordered]
    return Table(["bound of", "side", "t [s]", "multiplier", "price"], rows, digits=4)


_ROUNDING_OF_COSTS = 1e-12


def table_of_loops(results: Results) -> Table:
    """Return the metrics of every loop by reference and initial state, for a notebook.

    If the optimal cost rises by less than 1e-12 of the highest cost, the table shows "rounding".
    """
    counted = _read(results.control)
    by_loop = {f"{reference}, {start}": of for reference, starts in _by_start(counted) for start, of in starts.items()}
    columns = {
        "steps": "steps",
        "infeasible_steps": "without a plan",
        "first_infeasible_step": "first at",
        "unsolved_steps": "without an answer",
        "largest_rise": "largest rise of the cost",
        "worst_state_margin": "worst state margin",
        "worst_input_margin": "worst input margin",
    }
    highest = max((found["first_cost"] or 0.0 for found in by_loop.values()), default=0.0)
    for found in by_loop.values():
        if (found["largest_rise"] or math.inf) <= _ROUNDING_OF_COSTS * highest:
            found["largest_rise"] = "rounding"
    return _table("reference, start", columns, by_loop, digits=3)


def table_of_disturbances(results: Results) -> Table:
    """Return for each disturbed loop at how many steps there is no plan or a bound is broken; last, for many runs.

    The runs begin inside of the tube around `robust`.
    """
    *references, (_, runs) = _read(results.control)["disturbed"].items()
    columns = {
        "steps": "steps",
        "steps_without_plan": "without a plan",
        "first_step_without_plan": "first at",
        "steps_outside": "outside of bounds",
        "first_step_outside": "first at",
    }
    rows = {
        f"{controller} controller on {reference}, {kind}": found
        for reference, by_controller in references
        for controller, by_kind in by_controller.items()
        for kind, found in by_kind.items()
    }
    rows[f"{runs['runs']} runs in the tube"] = {"steps": runs["steps"], "steps_outside": runs["broken"]}
    return _table("disturbed", columns, rows, digits=6)


def table_of_room(results: Results) -> Table:
    """Return the price and the misfit of references proved for each size of the disturbance sets, 0 without room.

    The last row has the size at which, with this feedback, nothing is left between the bounds.
    """
    price = _read(results.control)["price_of_room"]
    rows = [*zip(price["sizes"], price["price"], price["misfit"], strict=True), (price["largest"], None, None)]
    return Table(["size", "price", "misfit"], rows, digits=3)


def table_of_offers(results: Results) -> Table:
    """Return for every reference that was learned again whether the loop tracks it from then on, and why."""
    offers = _read(results.control).get("online", {}).get("offers", [])
    rows = [[o["step"], "taken" if o["taken"] else "not taken", o["reason"]] for o in offers]
    return Table(["step", "", "why"], rows)
