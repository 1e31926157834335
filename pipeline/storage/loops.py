"""The log of the control stage, written and read back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.storage.archive import read_stage, write_stage
from pipeline.storage.logs import Series
from pipeline.storage.results import Results
from pipeline.storage.tables import Table
from trackable.arrays import Array
from trackable.control.loop_trajectory import LoopTrajectory
from trackable.files import from_json, to_json
from trackable.systems.constrained import ConstrainedSystem

STAGE = "control"
_SCALARS = ("cost", "stage_cost", "slack")


@dataclass(frozen=True, eq=False)
class ClosedLoops:
    """Courses by reference and by initial state; feasible states by horizon, as columns; the course along references
    that are learned again, and the columns of what was `offered` on the way: `step`, `taken` (1 or 0), `widening`."""

    courses: Mapping[str, Mapping[str, LoopTrajectory]]
    feasible: Mapping[int, Mapping[str, Array]]
    online: LoopTrajectory | None = None
    offered: Mapping[str, Array] | None = None


def write_loops(results: Results, plant: ConstrainedSystem, closed: ClosedLoops, metrics: object) -> None:
    """Every course losslessly, and the metrics as an attachment."""
    series = [
        _series(f"/loops/{reference}/{start}", plant, course)
        for reference, by_start in closed.courses.items()
        for start, course in by_start.items()
    ]
    series += [
        _of_columns(f"/feasible/horizon_{horizon}", plant, columns)
        for horizon, columns in closed.feasible.items()
        if len(columns["step"])
    ]
    if closed.online is not None and closed.offered is not None:
        series += [_series("/online", plant, closed.online), _of_columns("/offers", plant, closed.offered)]
    write_stage(results, STAGE, series, {"control.json": to_json(metrics)})


def read_loops(results: Results, plant: ConstrainedSystem) -> ClosedLoops:
    """The inverse of `write_loops`. InputError where the stage has not run, LogError where its log is damaged."""
    topics = {series.topic: series for series in read_stage(results, STAGE).series}
    courses: dict[str, dict[str, LoopTrajectory]] = {}
    feasible: dict[int, dict[str, Array]] = {}
    for topic, series in topics.items():
        match topic.split("/")[1:]:
            case ["loops", reference, start]:
                courses.setdefault(reference, {})[start] = _course(series, plant)
            case ["feasible", horizon]:
                feasible[int(horizon.removeprefix("horizon_"))] = _columns(series, plant)
    if "/online" not in topics:
        return ClosedLoops(courses, feasible)
    return ClosedLoops(courses, feasible, _course(topics["/online"], plant), _columns(topics["/offers"], plant))


def table_of_loops(results: Results) -> Table:
    """The metrics of every loop, for a notebook: by reference and initial state."""
    metrics = from_json(results.control.read_bytes())
    assert isinstance(metrics, dict)
    by_loop = {
        f"{reference}, {start}": found
        for reference, of in metrics.items()
        if reference not in ("horizon", "online")
        for start, found in of.items()
        if isinstance(found, dict)
    }
    columns = {
        "steps": "steps",
        "infeasible_steps": "without a plan",
        "first_infeasible_step": "first at",
        "largest_rise": "largest rise of the cost",
        "worst_state_margin": "worst state margin",
        "worst_input_margin": "worst input margin",
    }
    rows = [[name, *(found[key] for key in columns)] for name, found in by_loop.items()]
    return Table(["reference, start", *columns.values()], rows, digits=3)


def table_of_offers(results: Results) -> Table:
    """What became of every reference that was learned again."""
    metrics = from_json(results.control.read_bytes())
    assert isinstance(metrics, dict)
    offers = metrics.get("online", {}).get("offers", [])
    rows = [[o["step"], "taken" if o["taken"] else "not taken", o["reason"]] for o in offers]
    return Table(["step", "", "why"], rows)


def _series(topic: str, plant: ConstrainedSystem, course: LoopTrajectory) -> Series:
    columns = {
        **_named(plant.system.states, "", course.states),
        **_named(plant.system.inputs, "", course.inputs),
        **_named(plant.system.states, "_reference", course.reference_states),
        **_named(plant.system.inputs, "_reference", course.reference_inputs),
        **dict(zip(_SCALARS, (course.costs, course.stage_costs, course.slacks), strict=True)),
    }
    finite = {name: np.where(np.isfinite(values), values, np.nan) for name, values in columns.items()}
    return Series(topic, course.steps * plant.sampling_time, finite)


def _course(series: Series, plant: ConstrainedSystem) -> LoopTrajectory:
    def together(names: Sequence[str], suffix: str = "") -> Array:
        return np.stack([series.fields[name + suffix] for name in names], axis=-1)

    states, inputs = plant.system.states, plant.system.inputs
    return LoopTrajectory(
        _steps(series, plant),
        together(states),
        together(inputs),
        together(states, "_reference"),
        together(inputs, "_reference"),
        *(series.fields[name] for name in _SCALARS),
    )


def _named(names: Sequence[str], suffix: str, values: Array) -> dict[str, Array]:
    return {name + suffix: values[:, i] for i, name in enumerate(names)}


def _of_columns(topic: str, plant: ConstrainedSystem, columns: Mapping[str, Array]) -> Series:
    """Columns over `step`."""
    others = {name: values for name, values in columns.items() if name != "step"}
    return Series(topic, columns["step"] * plant.sampling_time, others)


def _columns(series: Series, plant: ConstrainedSystem) -> dict[str, Array]:
    return {"step": _steps(series, plant), **series.fields}


def _steps(series: Series, plant: ConstrainedSystem) -> Array:
    return np.asarray(np.round(series.times / plant.sampling_time))
