"""The log of the control stage: closed loops, disturbed ones and many runs, as series and as tables."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.loops.trajectory import LoopTrajectory, Runs
from pipeline.storage.archive import read_stage, write_stage
from pipeline.storage.logs import Series
from pipeline.storage.results import Results
from pipeline.storage.tables import Table
from trackably.arrays import Array
from trackably.files import from_json, read_json, to_json
from trackably.systems.constrained import ConstrainedSystem

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
_ROUNDING = 1e-12


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


def table_of_loops(results: Results) -> Table:
    """Return the metrics of every loop by reference and initial state, for a notebook.

    A cost that rises by less than 1e-12 of the highest one rises by rounding.
    """
    metrics: Any = read_json(results.control)
    by_loop = {
        f"{reference}, {start}": found
        for reference, of in metrics.items()
        if reference not in ("horizon", "online", "disturbed", "price_of_room")
        for start, found in of.items()
        if isinstance(found, dict)
    }
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
        if (found["largest_rise"] or math.inf) <= _ROUNDING * highest:
            found["largest_rise"] = "rounding"
    rows = [[name, *(found.get(key) for key in columns)] for name, found in by_loop.items()]
    return Table(["reference, start", *columns.values()], rows, digits=3)


def table_of_offers(results: Results) -> Table:
    """Return, for every reference that was learned again, whether it was taken over, and why."""
    metrics = read_json(results.control)
    assert isinstance(metrics, dict)
    offers = metrics.get("online", {}).get("offers", [])
    rows = [[o["step"], "taken" if o["taken"] else "not taken", o["reason"]] for o in offers]
    return Table(["step", "", "why"], rows)


def _of_columns(topic: str, plant: ConstrainedSystem, columns: Mapping[str, Array]) -> Series:
    """Return columns over `step` as a series."""
    others = {name: values for name, values in columns.items() if name != "step"}
    return Series(topic, columns["step"] * plant.sampling_time, others)


def _columns_of(series: Series, plant: ConstrainedSystem) -> dict[str, Array]:
    return {"step": steps_of(series, plant), **series.fields}
