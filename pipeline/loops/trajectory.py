"""Closed loops over time: initial states, metrics, and the form in which loops are logged, read and drawn."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from pipeline.storage.archive import read_stage, write_stage
from pipeline.storage.logs import Series, below
from pipeline.storage.results import Results
from trackably.arrays import Array, root_mean_square
from trackably.control.references import TrackedReference
from trackably.control.simulation import ClosedLoop
from trackably.control.stepping import Plan
from trackably.files import to_json
from trackably.systems.constrained import ConstrainedSystem

if TYPE_CHECKING:
    from trackably.control.controller import Controller


ON, ABOVE, BELOW = "on", "above", "below"
LOGGED = 600
"""The number of steps of an undisturbed loop that its log holds at most."""
_PARTS = 0.5 ** np.arange(1, 10)
"""By how much initial states differ from the reference, as parts of the widths."""


def initial_states(controller: "Controller", reference: TrackedReference, step: int = 0) -> dict[str, Array]:
    """Return states (n,) at a step by name: `on` the reference, `above` it and `below` it.

    `above` and `below` differ from the reference by ± half the widths of the state set, or by less: the difference is
    halved until the state lies in the set and the controller has a plan there. They are left out if 1/512 of the widths
    is still too much.
    """
    on_reference = reference.window(step, 1).states[0]
    widths = 1 / np.sqrt(np.diag(controller.Q))
    found = {ON: on_reference}
    for name, sign in ((ABOVE, 1.0), (BELOW, -1.0)):
        tried = (on_reference + sign * part * widths for part in _PARTS)
        state = next((state for state in tried if _is_feasible(controller, reference, step, state)), None)
        if state is not None:
            found[name] = state
    return found


def _is_feasible(controller: "Controller", reference: TrackedReference, step: int, state: Array) -> bool:
    inside = bool(controller.plant.state_set.margin(state) >= 0)
    return inside and isinstance(controller.step(step, state, reference), Plan)


def loop_metrics(loop: ClosedLoop, plant: ConstrainedSystem) -> dict[str, float | int | str | None]:
    """Return the metrics of a closed loop by name.

    Errors are x − x_r for each state. Margins are the smallest ones of the applied inputs, and of all states but the
    first. `largest_rise` is the largest V(k + 1) − (V(k) − ℓ(k)), which is at most zero on a trackable reference.
    """
    increases = loop.cost_increases[np.isfinite(loop.cost_increases)]
    errors = loop.errors
    found: dict[str, float | int | str | None] = {
        "steps": len(loop.inputs),
        "infeasible_steps": len(loop.infeasible),
        "first_infeasible_step": loop.infeasible[0].k if loop.infeasible else None,
        "unsolved_steps": len(loop.unsolved),
        "why": loop.without_plan[0].explanation if loop.without_plan else None,
        "first_cost": float(loop.costs[0]) if len(loop.costs) and np.isfinite(loop.costs[0]) else None,
        "largest_rise": float(np.max(increases)) if increases.size else None,
        "worst_state_margin": _smallest(plant.state_set.margin(loop.states[1:])),
        "worst_input_margin": _smallest(plant.input_set.margin(loop.inputs)),
    }
    for i, name in enumerate(plant.system.states):
        found[f"rms_error_{name}"] = root_mean_square(errors[:, i])
        found[f"last_error_{name}"] = float(abs(errors[-1, i]))
    return found


def first_untrackable_step(reference: TrackedReference, plant: ConstrainedSystem, steps: range) -> int | None:
    """Return the first of the `steps` at which the state or the input of a reference is outside its set.

    None if there is no such step.
    """
    window = reference.window(steps.start, len(steps))
    outside = (plant.state_set.margin(window.states[:-1]) < 0) | (plant.input_set.margin(window.inputs) < 0)
    return steps[int(np.argmax(outside))] if np.any(outside) else None


def _smallest(margins: Array) -> float | None:
    return float(np.min(margins)) if margins.size and np.all(np.isfinite(margins)) else None


_OF_PLANS = ("cost", "stage_cost", "slack")


@dataclass(frozen=True, eq=False)
class Course:
    """Named `columns` over `steps`, each of shape (K,); NaN where there is no value.

    A closed loop has columns of its states and inputs, of those of the reference (`x_reference`), and cost, stage_cost
    and slack of each step. At the last step, no input is applied: it has values of states only. Costs are NaN at steps
    without a plan, too.
    """

    steps: Array
    columns: Mapping[str, Array]

    @classmethod
    def of(cls, loop: ClosedLoop, plant: ConstrainedSystem) -> Self:
        """Return all steps of a closed loop."""
        names = [*plant.names, *(f"{name}_reference" for name in plant.names), *_OF_PLANS]
        plans = np.column_stack([loop.costs, loop.stage_costs, loop.slacks])
        inputs, reference_inputs, plans = (
            np.pad(of, ((0, 1), (0, 0)), constant_values=np.nan) for of in (loop.inputs, loop.reference_inputs, plans)
        )
        table = np.hstack([loop.states, inputs, loop.reference_states, reference_inputs, plans])
        finite = np.where(np.isfinite(table), table, np.nan)
        steps = loop.first_step + np.arange(len(table), dtype=float)
        return cls(steps, dict(zip(names, finite.T, strict=True)))

    def __getitem__(self, name: str) -> Array:
        return self.columns[name]

    def together(self, names: Sequence[str], suffix: str = "") -> Array:
        """Return the columns `names`, with the `suffix` added to each name, as an array of shape (K, len(names))."""
        return np.stack([self.columns[name + suffix] for name in names], axis=-1)

    def until(self, step: int) -> Self:
        """Return the part of the course up to and including a step."""
        kept = self.steps <= step
        return type(self)(self.steps[kept], {name: values[kept] for name, values in self.columns.items()})

    @property
    def infeasible(self) -> Array:
        """The steps of a closed loop at which an input was applied without a plan."""
        others = [values for name, values in self.columns.items() if name not in _OF_PLANS]
        return np.asarray(self.steps[np.isnan(self["cost"]) & np.all(np.isfinite(others), axis=0)])


def runs_of(steps: Array) -> list[tuple[int, int]]:
    """Return the first and the last step of each run of consecutive steps; `steps` are increasing."""
    runs = np.split(steps, np.flatnonzero(np.diff(steps) > 1) + 1)
    return [(int(run[0]), int(run[-1])) for run in runs if run.size]


Courses = Mapping[str, Course]
"""Courses by topic: /loops/REFERENCE/START, /online, /offers, /disturbed/REFERENCE/…"""


def many_courses(steps: Array, plant: ConstrainedSystem, runs: Array, kept: int) -> dict[str, Course]:
    """Return the range of `runs` (R, K, n + m) of states and inputs at `steps` (K,), and `kept` runs, by topic."""
    names = [f"{name}_{end}" for end in ("lowest", "highest") for name in plant.names]
    columns = dict(zip(names, np.hstack([runs.min(axis=0), runs.max(axis=0)]).T, strict=True))
    single = (Course(steps, dict(zip(plant.names, run.T, strict=True))) for run in runs[:kept])
    return {"/disturbed_range": Course(steps, columns)} | {f"/disturbed_runs/{r}": of for r, of in enumerate(single)}


STAGE = "control"


def by_reference(courses: Courses) -> dict[str, dict[str, Course]]:
    """Return the undisturbed loops by reference and by initial state."""
    names = dict.fromkeys(name.split("/")[0] for name in below(courses, "loops"))
    return {name: below(courses, "loops", name) for name in names}


def write_loops(results: Results, plant: ConstrainedSystem, courses: Courses, metrics: object) -> None:
    """Write every course losslessly, and the metrics as an attachment."""
    series = [Series(topic, of.steps * plant.sampling_time, of.columns) for topic, of in courses.items()]
    write_stage(results, STAGE, series, {"control.json": to_json(metrics)})


def read_loops(results: Results, plant: ConstrainedSystem) -> Courses:
    """Read what `write_loops` wrote. Raises InputError if the stage has not run, or for a damaged log."""
    series = read_stage(results, STAGE).series
    return {of.topic: Course(np.round(of.times / plant.sampling_time), of.fields) for of in series}
