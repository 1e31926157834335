"""Write and read the log of the control stage, and show it as tables."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

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
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class ClosedLoops:
    """Closed loops of an experiment.

    `courses` are by reference and by initial state. `feasible` states are columns by horizon. `online` is the loop
    along references that are learned again; `offered` are the columns `step`, `taken` (1 or 0) and `widening` of these.
    """

    courses: Mapping[str, Mapping[str, LoopTrajectory]]
    feasible: Mapping[int, Mapping[str, Array]]
    online: LoopTrajectory | None = None
    offered: Mapping[str, Array] | None = None


def write_loops(results: Results, plant: ConstrainedSystem, closed: ClosedLoops, metrics: object) -> None:
    """Write every loop losslessly, and the metrics as an attachment."""
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
    """Read what `write_loops` wrote. Raises InputError where the stage has not run, and LogError for a damaged log."""
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
    """Return the metrics of every loop by reference and initial state, for a notebook.

    A cost that rises by less than 1e-12 of the highest one rises by rounding.
    """
    metrics: Any = from_json(results.control.read_bytes())
    by_loop = {
        f"{reference}, {start}": found
        for reference, of in metrics.items()
        if reference not in ("horizon", "online", "disturbed")
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
    """Return columns over `step` as a series."""
    others = {name: values for name, values in columns.items() if name != "step"}
    return Series(topic, columns["step"] * plant.sampling_time, others)


def _columns(series: Series, plant: ConstrainedSystem) -> dict[str, Array]:
    return {"step": _steps(series, plant), **series.fields}


def _steps(series: Series, plant: ConstrainedSystem) -> Array:
    return np.asarray(np.round(series.times / plant.sampling_time))
