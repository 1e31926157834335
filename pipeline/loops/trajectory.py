"""Closed loops over time: where they begin, their numbers, and the form in which they are logged, read and drawn."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.storage.archive import read_stage, write_stage
from pipeline.storage.logs import Series
from pipeline.storage.results import Results
from trackably.arrays import Array
from trackably.control.references import TrackedReference
from trackably.control.simulation import ClosedLoop
from trackably.control.stepping import Plan
from trackably.files import from_json, to_json
from trackably.systems.constrained import ConstrainedSystem

if TYPE_CHECKING:
    from trackably.control.controller import Controller


ON, ABOVE, BELOW = "on", "above", "below"
_SMALLEST = 1e-3
"""Initial states closer to the reference than this part of the widths are not tried."""


def initial_states(controller: "Controller", reference: TrackedReference, step: int = 0) -> dict[str, Array]:
    """Return states (n,) at a step by name: `on` the reference, `above` it and `below` it.

    The latter two differ from the reference by ± half the widths of the state set, halved until the state lies in the
    set and the controller has a plan there. They are left out where even a thousandth of the widths is too much.
    """
    on_reference = reference.window(step, 1).states[0]
    widths = 1 / np.sqrt(np.diag(controller.Q))
    found = {ON: on_reference}
    for name, sign in ((ABOVE, 1.0), (BELOW, -1.0)):
        part = 0.5
        while part > _SMALLEST and not _is_feasible(controller, reference, step, on_reference + sign * part * widths):
            part /= 2
        if part > _SMALLEST:
            found[name] = np.asarray(on_reference + sign * part * widths)
    return found


def _is_feasible(controller: "Controller", reference: TrackedReference, step: int, state: Array) -> bool:
    inside = bool(controller.plant.state_set.margin(state) >= 0)
    return inside and isinstance(controller.step(step, state, reference), Plan)


def loop_metrics(loop: ClosedLoop, plant: ConstrainedSystem) -> dict[str, float | int | str | None]:
    """Return the numbers of a closed loop by name.

    Errors are x − x_r for each state. Margins are the smallest ones of the applied inputs, and of all states but the
    first. `largest_rise` is the largest V(k + 1) − (V(k) − ℓ(k)), which is at most zero on a trackable reference.
    """
    increases = loop.cost_increases[np.isfinite(loop.cost_increases)]
    errors = loop.errors
    found: dict[str, float | int | str | None] = {
        "steps": len(loop.inputs),
        "infeasible_steps": len(loop.infeasible),
        "first_infeasible_step": loop.first_infeasible_step,
        "unsolved_steps": len(loop.unsolved),
        "why": loop.without_plan[0].explanation if loop.without_plan else None,
        "first_cost": float(loop.costs[0]) if len(loop.costs) and np.isfinite(loop.costs[0]) else None,
        "largest_rise": float(np.max(increases)) if increases.size else None,
        "worst_state_margin": _smallest(plant.state_set.margin(loop.states[1:])),
        "worst_input_margin": _smallest(plant.input_set.margin(loop.inputs)),
    }
    for i, name in enumerate(plant.system.states):
        found[f"rms_error_{name}"] = float(np.sqrt(np.mean(errors[:, i] ** 2)))
        found[f"last_error_{name}"] = float(abs(errors[-1, i]))
    return found


def first_untrackable_step(reference: TrackedReference, plant: ConstrainedSystem, steps: range) -> int | None:
    """Return the first of the `steps` at which the state or the input of a reference is outside its set; None where
    there is no such step."""
    window = reference.window(steps.start, len(steps))
    outside = (plant.state_set.margin(window.states[:-1]) < 0) | (plant.input_set.margin(window.inputs) < 0)
    return steps[int(np.argmax(outside))] if np.any(outside) else None


def _smallest(margins: Array) -> float | None:
    return float(np.min(margins)) if margins.size and np.all(np.isfinite(margins)) else None


@dataclass(frozen=True, eq=False)
class LoopTrajectory:
    """States (K + 1, n) and inputs (K + 1, m) at `steps` (K + 1,), those of the reference, and the cost of each step.

    Inputs and costs are NaN at the last step, where nothing is applied; costs are NaN at infeasible steps too.
    """

    steps: Array
    states: Array
    inputs: Array
    reference_states: Array
    reference_inputs: Array
    costs: Array
    stage_costs: Array
    slacks: Array

    @classmethod
    def of(cls, loop: ClosedLoop) -> "LoopTrajectory":
        """Return all steps of a closed loop."""
        return cls(
            steps=loop.first_step + np.arange(len(loop.states), dtype=float),
            states=loop.states,
            inputs=_with_last(loop.inputs),
            reference_states=loop.reference_states,
            reference_inputs=_with_last(loop.reference_inputs),
            costs=_with_last(loop.costs),
            stage_costs=_with_last(loop.stage_costs),
            slacks=_with_last(loop.slacks),
        )

    def until(self, step: int) -> "LoopTrajectory":
        """Return the part up to and including a step."""
        kept = self.steps <= step
        return LoopTrajectory(*(getattr(self, field.name)[kept] for field in fields(self)))

    @property
    def infeasible(self) -> Array:
        """The steps at which an input was applied without a plan."""
        return self.steps[np.isnan(self.costs) & np.isfinite(self.inputs[:, 0])]


def _with_last(values: Array) -> Array:
    """Append NaN for the last step."""
    return np.concatenate([values, np.full((1, *values.shape[1:]), np.nan)])


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs of the tube controller at `steps` (K,): coordinates are the states, then the inputs.

    `lowest` and `highest` (K, n + m) are taken over all runs; some `single` runs (R, K, n + m) are kept.
    """

    steps: Array
    lowest: Array
    highest: Array
    single: Array


_SCALARS = ("cost", "stage_cost", "slack")


def loop_series(topic: str, plant: ConstrainedSystem, course: LoopTrajectory) -> Series:
    """Return a loop as a series."""
    columns = {
        **_named(plant.system.states, "", course.states),
        **_named(plant.system.inputs, "", course.inputs),
        **_named(plant.system.states, "_reference", course.reference_states),
        **_named(plant.system.inputs, "_reference", course.reference_inputs),
        **dict(zip(_SCALARS, (course.costs, course.stage_costs, course.slacks), strict=True)),
    }
    finite = {name: np.where(np.isfinite(values), values, np.nan) for name, values in columns.items()}
    return Series(topic, course.steps * plant.sampling_time, finite)


def loop_of(series: Series, plant: ConstrainedSystem) -> LoopTrajectory:
    """Return the loop that such a series holds."""

    def together(names: Sequence[str], suffix: str = "") -> Array:
        return np.stack([series.fields[name + suffix] for name in names], axis=-1)

    states, inputs = plant.system.states, plant.system.inputs
    return LoopTrajectory(
        steps_of(series, plant),
        together(states),
        together(inputs),
        together(states, "_reference"),
        together(inputs, "_reference"),
        *(series.fields[name] for name in _SCALARS),
    )


def _named(names: Sequence[str], suffix: str, values: Array) -> dict[str, Array]:
    return {name + suffix: values[:, i] for i, name in enumerate(names)}


def steps_of(series: Series, plant: ConstrainedSystem) -> Array:
    """Return the steps of a series."""
    return np.asarray(np.round(series.times / plant.sampling_time))


Loops = Mapping[str, Mapping[str, Mapping[str, LoopTrajectory]]]
"""By reference, controller and kind of disturbance."""

_LOOPS, _RUNS, _RANGE = "disturbed", "disturbed_runs", "/disturbed_range"


@dataclass(frozen=True, eq=False)
class Disturbed:
    """The `loops` one by one, and many `runs`."""

    loops: Loops
    runs: Runs


def disturbed_series(plant: ConstrainedSystem, disturbed: Disturbed) -> list[Series]:
    """Return loops and runs as series."""
    found = [
        loop_series(f"/{_LOOPS}/{reference}/{controller}/{kind}", plant, course)
        for reference, by_controller in disturbed.loops.items()
        for controller, by_kind in by_controller.items()
        for kind, course in by_kind.items()
    ]
    runs, names = disturbed.runs, _coordinates(plant)
    times = runs.steps * plant.sampling_time
    ends = {f"{name}_lowest": runs.lowest[:, i] for i, name in enumerate(names)}
    ends |= {f"{name}_highest": runs.highest[:, i] for i, name in enumerate(names)}
    found.append(Series(_RANGE, times, ends))
    for r, values in enumerate(runs.single):
        found.append(Series(f"/{_RUNS}/{r}", times, {name: values[:, i] for i, name in enumerate(names)}))
    return found


def read_disturbed(topics: Mapping[str, Series], plant: ConstrainedSystem) -> Disturbed | None:
    """Return what `disturbed_series` gave to a log; None where nothing was disturbed."""
    if _RANGE not in topics:
        return None
    loops: dict[str, dict[str, dict[str, LoopTrajectory]]] = {}
    single: dict[int, Array] = {}
    names, range_of = _coordinates(plant), topics[_RANGE]
    for topic, series in topics.items():
        match topic.split("/")[1:]:
            case ["disturbed", reference, controller, kind]:
                loops.setdefault(reference, {}).setdefault(controller, {})[kind] = loop_of(series, plant)
            case ["disturbed_runs", r]:
                single[int(r)] = np.column_stack([series.fields[name] for name in names])
    lowest, highest = (
        np.column_stack([range_of.fields[name + end] for name in names]) for end in ("_lowest", "_highest")
    )
    return Disturbed(
        loops, Runs(steps_of(range_of, plant), lowest, highest, np.array([single[r] for r in sorted(single)]))
    )


def _coordinates(plant: ConstrainedSystem) -> tuple[str, ...]:
    return (*plant.system.states, *plant.system.inputs)


STAGE = "control"


@dataclass(frozen=True, eq=False)
class ClosedLoops:
    """Closed loops of an experiment.

    `courses` are by reference and by initial state. `feasible` states are columns by horizon. `online` is the loop
    along references that are learned again; `offered` are the columns `step`, `taken` (1 or 0) and `widening` of these.
    `disturbed` holds what was disturbed, if anything was.
    """

    courses: Mapping[str, Mapping[str, LoopTrajectory]]
    feasible: Mapping[int, Mapping[str, Array]]
    online: LoopTrajectory | None = None
    offered: Mapping[str, Array] | None = None
    disturbed: Disturbed | None = None


def write_loops(results: Results, plant: ConstrainedSystem, closed: ClosedLoops, metrics: object) -> None:
    """Write every loop losslessly, and the metrics as an attachment."""
    series = [
        loop_series(f"/loops/{reference}/{start}", plant, course)
        for reference, by_start in closed.courses.items()
        for start, course in by_start.items()
    ]
    series += [
        _of_columns(f"/feasible/horizon_{horizon}", plant, columns)
        for horizon, columns in closed.feasible.items()
        if len(columns["step"])
    ]
    if closed.online is not None and closed.offered is not None:
        series += [loop_series("/online", plant, closed.online), _of_columns("/offers", plant, closed.offered)]
    if closed.disturbed is not None:
        series += disturbed_series(plant, closed.disturbed)
    write_stage(results, STAGE, series, {"control.json": to_json(metrics)})


def read_loops(results: Results, plant: ConstrainedSystem) -> ClosedLoops:
    """Read what `write_loops` wrote. Raises InputError where the stage has not run, and LogError for a damaged log."""
    topics = {series.topic: series for series in read_stage(results, STAGE).series}
    courses: dict[str, dict[str, LoopTrajectory]] = {}
    feasible: dict[int, dict[str, Array]] = {}
    for topic, series in topics.items():
        match topic.split("/")[1:]:
            case ["loops", reference, start]:
                courses.setdefault(reference, {})[start] = loop_of(series, plant)
            case ["feasible", horizon]:
                feasible[int(horizon.removeprefix("horizon_"))] = _columns_of(series, plant)
    disturbed = read_disturbed(topics, plant)
    if "/online" not in topics:
        return ClosedLoops(courses, feasible, disturbed=disturbed)
    online, offered = loop_of(topics["/online"], plant), _columns_of(topics["/offers"], plant)
    return ClosedLoops(courses, feasible, online, offered, disturbed)


def read_loop_metrics(results: Results) -> dict[str, Any]:
    """Read the metrics that the log holds. Raises as `read_loops`."""
    metrics = from_json(read_stage(results, STAGE).attachments["control.json"])
    assert isinstance(metrics, dict), "written as one"
    return metrics


def _of_columns(topic: str, plant: ConstrainedSystem, columns: Mapping[str, Array]) -> Series:
    """Return columns over `step` as a series."""
    others = {name: values for name, values in columns.items() if name != "step"}
    return Series(topic, columns["step"] * plant.sampling_time, others)


def _columns_of(series: Series, plant: ConstrainedSystem) -> dict[str, Array]:
    return {"step": steps_of(series, plant), **series.fields}
