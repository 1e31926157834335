"""Events of a single closed loop: where it loses feasibility, and where it takes over a new reference."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from trackably.arrays import Array
from trackably.control.loop_trajectory import LoopTrajectory
from trackably.plots.panels import (
    CLOSED_LOOP,
    UNKNOWN_UNITS,
    Units,
    bounds_of,
    coordinate_values,
    coordinates,
    draw_coordinate,
    fit_limits,
    pad_limits,
    shade_no_plan,
    shade_outside,
    stacked_panels,
)
from trackably.plots.style import BLUE, GREY, INK, ORANGE, direct_label, legend_above, step_label, styled
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.sets.interval import Interval

_UPDATE: Final[dict[str, Any]] = {"linestyle": "none", "clip_on": False, "zorder": 5}
_UPDATES: Final[dict[float, dict[str, Any]]] = {
    1.0: {**_UPDATE, "marker": "v", "color": BLUE, "markersize": 5, "label": "new reference taken"},
    0.0: {**_UPDATE, "marker": "x", "color": ORANGE, "markersize": 5, "label": "not taken"},
}


@styled
def infeasibility(
    trajectory: LoopTrajectory, plant: ConstrainedSystem, horizon: int, units: Units = UNKNOWN_UNITS
) -> Figure:
    """Draw the loop around its first infeasible step, and mark the `horizon` steps over which a plan would reach.

    Steps at which there is no plan are shaded.
    """
    names, first = coordinates(plant), float(trajectory.infeasible[0])
    begin, end = max(0.0, first - horizon), first + 3 * horizon
    figure, panels = stacked_panels(names, 0.8, units)
    part = trajectory.until(int(end))
    for i, (axes, name) in enumerate(zip(panels, names, strict=True)):
        draw_coordinate(axes, part, i, CLOSED_LOOP)
        shade_no_plan(axes, part.infeasible)
        shown = np.concatenate([values[part.steps >= begin] for values in coordinate_values(part, i)])
        pad_limits(axes, Interval(float(np.nanmin(shown)), float(np.nanmax(shown))))
        shade_outside(axes, bounds_of(plant).get(name))
        axes.axvline(first, color=INK, linewidth=0.8, linestyle=":", zorder=2.8)
        axes.axvline(first + horizon, color=INK, linewidth=0.8, linestyle=":", zorder=2.8)
    panels[0].annotate(
        "", (first, 1.04), (first + horizon, 1.04), xycoords=panels[0].get_xaxis_transform(),
        arrowprops={"arrowstyle": "<->", "linewidth": 0.7, "shrinkA": 0, "shrinkB": 0}, annotation_clip=False,
    )  # fmt: skip
    label = f" from step {first:.0f} no plan reaches step {first + horizon:.0f}"
    where = panels[0].get_xaxis_transform()
    direct_label(panels[0], first + horizon, 1.04, label, transform=where, va="center", clip_on=False)
    panels[-1].set(xlabel=step_label(plant.sampling_time), xlim=(begin, min(end, part.steps[-1])))
    figure.align_ylabels(panels)
    legend_above(figure)
    return figure


@styled
def relearned(
    trajectory: LoopTrajectory,
    updates: Mapping[str, Array],
    plant: ConstrainedSystem,
    units: Units = UNKNOWN_UNITS,
) -> Figure:
    """Draw a loop whose reference is learned again, and mark each update as taken or not.

    `updates` has the columns `step` and `taken` (1 or 0).
    """
    names = coordinates(plant)
    figure, panels = stacked_panels(names, 0.8, units)
    for i, (axes, name) in enumerate(zip(panels, names, strict=True)):
        draw_coordinate(axes, trajectory, i, CLOSED_LOOP)
        fit_limits(axes, bounds_of(plant).get(name), coordinate_values(trajectory, i)[0])
        for taken, style in _UPDATES.items():
            steps = updates["step"][updates["taken"] == taken]
            if steps.size:
                axes.plot(steps, np.full(steps.size, 1.0), transform=axes.get_xaxis_transform(), **style)
                axes.vlines(steps, 0, 1, transform=axes.get_xaxis_transform(), colors=GREY, linewidths=0.6, zorder=2)
    panels[-1].set(xlabel=step_label(plant.sampling_time), xlim=(0, trajectory.steps[-1]))
    figure.align_ylabels(panels)
    legend_above(figure)
    return figure
