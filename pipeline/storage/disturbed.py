"""Disturbed loops in the log of the control stage: single ones, and what hundreds of runs do together."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pipeline.storage.logs import Series
from pipeline.storage.loop_series import loop_of, loop_series, steps_of
from trackably.arrays import Array
from trackably.control.loop_trajectory import LoopTrajectory, Runs
from trackably.systems.constrained import ConstrainedSystem

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
