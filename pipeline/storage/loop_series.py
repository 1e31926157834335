"""Loops as series of a log, and back."""

from collections.abc import Sequence

import numpy as np

from pipeline.storage.logs import Series
from trackably.arrays import Array
from trackably.control.loop_trajectory import LoopTrajectory
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
