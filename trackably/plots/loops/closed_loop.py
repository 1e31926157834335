"""The closed loop over time, for several references and initial states: states, inputs and the optimal cost."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackably.control.loop_trajectory import LoopTrajectory
from trackably.plots.panels import (
    INITIAL_STATE_STYLES,
    UNKNOWN_UNITS,
    Units,
    axis_label,
    bounds_of,
    coordinate_values,
    coordinates,
    draw_coordinate,
    fit_limits,
    shade_no_plan,
    shade_outside,
)
from trackably.plots.style import GREY, PAGE, direct_label, legend_above, step_label, styled
from trackably.systems.constrained import ConstrainedSystem

ByInitialState = Mapping[str, LoopTrajectory]
_ROUNDING: Final = 1e-16


@styled
def closed_loop(
    loops: Mapping[str, ByInitialState], plant: ConstrainedSystem, last_step: int, units: Units = UNKNOWN_UNITS
) -> Figure:
    """Draw states and inputs up to `last_step`, one column for each reference by its label.

    Steps are shaded where no initial state leaves the controller with a plan.
    """
    names = coordinates(plant)
    figure = Figure(figsize=(PAGE, 0.9 + 1.25 * len(names)))
    panels = figure.subplots(len(names), len(loops), sharex=True, sharey="row", squeeze=False)
    for column, (label, by_state) in zip(panels.T, loops.items(), strict=True):
        column[0].set_title(f"{label} reference")
        column[-1].set_xlabel(step_label(plant.sampling_time))
        for i, axes in enumerate(column):
            for initial_state, trajectory in by_state.items():
                draw_coordinate(axes, trajectory.until(last_step), i, INITIAL_STATE_STYLES[initial_state])
            _shade_where_none_has_a_plan(axes, by_state, last_step, named=axes is column[0])
    for i, (name, row) in enumerate(zip(names, panels, strict=True)):
        row[0].set_ylabel(axis_label(name, units))
        values = [coordinate_values(t.until(last_step), i)[0] for by_state in loops.values() for t in by_state.values()]
        fit_limits(row[0], bounds_of(plant).get(name), np.concatenate(values))
        for axes in row[1:]:
            shade_outside(axes, bounds_of(plant).get(name))
    panels[0, 0].set_xlim(0, last_step)
    figure.align_ylabels(panels[:, 0])
    legend_above(figure)
    return figure


@styled
def costs(loops: Mapping[str, ByInitialState], plant: ConstrainedSystem, last_step: int) -> Figure:
    """Draw V_N(k) up to `last_step`, one panel for each reference by its label.

    Values below 1e-16 are rounding, and are drawn at 1e-16.
    """
    figure = Figure(figsize=(PAGE, 2.5))
    panels = figure.subplots(1, len(loops), sharey=True, squeeze=False)[0]
    for axes, (label, by_state) in zip(panels, loops.items(), strict=True):
        for initial_state, trajectory in by_state.items():
            part = trajectory.until(last_step)
            axes.plot(part.steps, np.maximum(part.costs, _ROUNDING), **INITIAL_STATE_STYLES[initial_state])
        _shade_where_none_has_a_plan(axes, by_state, last_step)
        axes.set(title=f"{label} reference", xlabel=step_label(plant.sampling_time), xlim=(0, last_step))
    panels[0].set(ylabel=r"optimal cost $V_N(k)$ [–]", yscale="log")
    legend_above(figure)
    return figure


def _shade_where_none_has_a_plan(axes: Axes, by_state: ByInitialState, last_step: int, named: bool = True) -> None:
    """Shade steps at which no loop that still runs has a plan, and mark the step at which the last loop ended."""
    ends = {name: float(trajectory.steps[-1]) for name, trajectory in by_state.items()}
    ended = max(ends.values())
    infeasible = {name: set(trajectory.infeasible.tolist()) for name, trajectory in by_state.items()}
    steps = np.arange(min(ended, last_step + 1.0))
    shade_no_plan(axes, np.array([k for k in steps if all(k in infeasible[name] or k >= ends[name] for name in ends)]))
    if ended < last_step:
        axes.axvline(ended, color=GREY, linewidth=0.8, linestyle=":")
        if named:
            side = "right" if ended > last_step / 2 else "left"
            where = axes.get_xaxis_transform()
            direct_label(axes, ended, 0.5, " given up ", transform=where, va="center", ha=side, color=GREY)
