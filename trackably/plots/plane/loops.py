"""Closed loops in the plane of two states."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from trackably.control.loop_trajectory import LoopTrajectory
from trackably.plots.panels import INITIAL_STATE_STYLES, UNKNOWN_UNITS, Units
from trackably.plots.plane.path import label_plane
from trackably.plots.style import GREY, INK, PAGE, legend_above, styled
from trackably.systems.constrained import ConstrainedSystem

_EVERY: Final = 5
_CLOSE: Final = 0.01
"""Lines to the reference are left out once they are shorter than this part of the picture."""


@styled
def loops_in_plane(
    loops: Mapping[str, LoopTrajectory],
    plant: ConstrainedSystem,
    plane: tuple[str, str],
    last_step: int,
    units: Units = UNKNOWN_UNITS,
) -> Figure:
    """Draw loops by their initial states up to `last_step`, and the reference that they follow.

    Thin lines lead from the state at every fifth step to the reference at the same step.
    """
    columns = [plant.system.states.index(name) for name in plane]
    figure = Figure(figsize=(PAGE, 4.2))
    axes = figure.subplots()
    for initial_state, trajectory in loops.items():
        part = trajectory.until(last_step)
        states, reference = part.states[:, columns], part.reference_states[:, columns]
        axes.plot(*states.T, **INITIAL_STATE_STYLES[initial_state])
        axes.plot(*states[0], "o", color=INK, markersize=4, zorder=5)
        for here, there in zip(states[::_EVERY], reference[::_EVERY], strict=True):
            if np.linalg.norm(here - there) > _CLOSE * np.max(np.ptp(reference, axis=0)):
                axes.plot(*np.array([here, there]).T, color=GREY, linewidth=0.5, zorder=2.0)
    reference = max(loops.values(), key=lambda loop: len(loop.steps)).until(last_step).reference_states[:, columns]
    axes.plot(*reference.T, color=INK, linewidth=0.7, zorder=3.6, label="reference")
    label_plane(axes, plane, units)
    legend_above(figure)
    return figure
