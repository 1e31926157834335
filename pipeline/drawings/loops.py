"""Figures of closed loops: over time, learned again, disturbed."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipeline.drawings.style import DOTTED, GREY, Units, axis_label, direct_label, step_label
from pipeline.loops.trajectory import ON, Course, runs_of
from trackably.arrays import Array
from trackably.exports.figures import (
    BLUE,
    BOUND,
    GREEN,
    INK,
    NAVY,
    ORANGE,
    OUTSIDE,
    PALE,
    bounds_of,
    legend_above,
    pad_limits,
    panels_of,
    shade_outside,
    with_style,
)
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.reference import Window

ByInitialState = Mapping[str, Course]
INITIAL_STATE_STYLES: Final[dict[str, dict[str, Any]]] = {
    "on": {"color": GREEN, "linestyle": "-", "linewidth": 2.2, "zorder": 3.0, "label": "from the reference"},
    "above": {"color": ORANGE, "linestyle": (0, (5, 1.4)), "linewidth": 1.2, "zorder": 3.2, "label": "from above it"},
    "below": {"color": BLUE, "linestyle": (0, (1.4, 1)), "linewidth": 1.4, "zorder": 3.3, "label": "from below it"},
}
"""Styles of loops by the names of initial states that `pipeline.loops.trajectory` gives."""
CLOSED_LOOP: Final = INITIAL_STATE_STYLES["on"] | {"label": "closed loop"}
_REFERENCE: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.7, "zorder": 3.6, "label": "reference"}
_NO_PLAN: Final[dict[str, Any]] = {"facecolor": PALE, "alpha": 0.6, "zorder": 1, "label": "no plan"}


@with_style
def closed_loop(loops: Mapping[str, ByInitialState], plant: ConstrainedSystem, last_step: int, units: Units) -> Figure:
    """Draw states and inputs up to `last_step`, one column for each reference by its label.

    Steps at which the controller has no plan from any of the initial states are shaded.
    """
    figure, panels = _over_steps(loops, plant, (0, last_step), INITIAL_STATE_STYLES, units)
    for column, (label, by_state) in zip(panels.T, loops.items(), strict=True):
        column[0].set_title(f"{label} reference")
        for axes in column:
            _shade_where_none_has_a_plan(axes, by_state, last_step, named=axes is column[0])
    return legend_above(figure)


def _over_steps(
    loops: Mapping[str, ByInitialState],
    plant: ConstrainedSystem,
    shown: tuple[float, float],
    styles: Mapping[str, dict[str, Any]],
    units: Units,
) -> tuple[Figure, NDArray[Any]]:
    """Draw states and inputs with their bounds and references, from the first to the last step of `shown`.

    There is a row for each coordinate, and a column for each label of the loops; `styles` are by initial state. Panels
    show the whole range between the bounds.
    """
    figure, panels = _grid(plant, len(loops), shown, units, sharey="row")
    bounds = bounds_of(plant)
    parts = [{name: of.until(int(shown[1])) for name, of in by_name.items()} for by_name in loops.values()]
    for name, row in zip(plant.names, panels, strict=True):
        for axes, by_name in zip(row, parts, strict=True):
            for loop, course in by_name.items():
                drawstyle = "steps-post" if name in plant.system.inputs else "default"  # inputs are held between steps
                axes.plot(course.steps, course[name], drawstyle=drawstyle, **styles[loop])
                axes.plot(course.steps, course[f"{name}_reference"], drawstyle=drawstyle, **_REFERENCE)
        seen = np.concatenate([of[name] for by_name in parts for of in by_name.values()])
        pad_limits(row[0], bounds.get(name) or Interval(float(np.nanmin(seen)), float(np.nanmax(seen))))
        for axes in row:
            shade_outside(axes, bounds.get(name))
    return figure, panels


def _grid(
    plant: ConstrainedSystem,
    columns: int,
    shown: tuple[float, float],
    units: Units,
    sharey: Literal["none", "row"] = "none",
) -> tuple[Figure, NDArray[Any]]:
    """Return a figure with a row of panels for each state and input, from the first to the last step of `shown`."""
    count = len(plant.names)
    figure, panels = panels_of(0.9 + 1.25 * count, count, columns, sharex=True, sharey=sharey)
    for axes, name in zip(panels[:, 0], plant.names, strict=True):
        axes.set_ylabel(axis_label(name, units))
    for axes in panels[-1]:
        axes.set(xlabel=step_label(plant.sampling_time), xlim=shown)
    figure.align_ylabels(panels[:, 0])
    return figure, panels


def _shade_where_none_has_a_plan(axes: Axes, by_state: ByInitialState, last_step: int, named: bool = True) -> None:
    """Shade the steps at which no running loop has a plan, and mark the step at which the last loop ended."""
    ended = float(max(course.steps[-1] for course in by_state.values()))
    lost = ({*course.infeasible.tolist(), *np.arange(course.steps[-1], ended)} for course in by_state.values())
    for first, last in runs_of(np.array(sorted(k for k in set.intersection(*lost) if k <= last_step))):
        axes.axvspan(first, last + 1, **_NO_PLAN)  # up to the step after it
    if ended < last_step:
        axes.axvline(ended, color=GREY, **DOTTED)
        if named:
            side = "right" if ended > last_step / 2 else "left"
            where = axes.get_xaxis_transform()
            direct_label(axes, ended, 0.5, " given up ", transform=where, va="center", ha=side, color=GREY)


_UPDATE: Final[dict[str, Any]] = {"linestyle": "none", "clip_on": False, "zorder": 5}
_UPDATES: Final[dict[float, dict[str, Any]]] = {
    1.0: {**_UPDATE, "marker": "v", "color": BLUE, "markersize": 5, "label": "new reference taken"},
    0.0: {**_UPDATE, "marker": "x", "color": ORANGE, "markersize": 5, "label": "not taken"},
}


@with_style
def relearned(course: Course, updates: Course, plant: ConstrainedSystem, units: Units) -> Figure:
    """Draw a loop whose reference is learned again, and mark each update; `taken` is 1 if it was accepted, else 0."""
    shown = 0.0, float(course.steps[-1])
    figure, panels = _over_steps({"": {ON: course}}, plant, shown, {ON: CLOSED_LOOP}, units)
    for axes in panels[:, 0]:
        where = axes.get_xaxis_transform()
        for taken, style in _UPDATES.items():
            steps = updates.steps[updates["taken"] == taken]
            if steps.size:
                axes.plot(steps, np.ones(steps.size), transform=where, **style)
                axes.vlines(steps, 0, 1, transform=where, colors=GREY, linewidths=0.6, zorder=2)
    return legend_above(figure)


_TUBE: Final[dict[str, Any]] = {"facecolor": BLUE, "alpha": 0.16, "zorder": 1.5, "label": "tube"}
_RANGE: Final = _TUBE | {"alpha": 0.34, "zorder": 1.6}
_FOLLOWED: Final[dict[str, Any]] = {"color": ORANGE, "linewidth": 1.3, "zorder": 3.4, "label": "reference"}
_SINGLE: Final[dict[str, Any]] = {"color": NAVY, "linewidth": 0.4, "zorder": 3}


@with_style
def tube_runs(
    runs: Course,
    single: Sequence[Course],
    count: int,
    window: Window,
    room: tuple[Array, Array],
    plant: ConstrainedSystem,
    units: Units,
) -> Figure:
    """Draw the tube around a reference, and runs of the disturbed system inside of it.

    Left panels show values over time, right panels differences from the reference, with the distances to the bounds.
    `room` is how far states and inputs may be below and above the reference, each (n + m,). The range of all `count`
    runs, the columns x_lowest and x_highest of `runs`, is shaded, and the runs `single` are drawn.
    """
    figure, panels = _grid(plant, 2, (runs.steps[0], runs.steps[-1]), units)
    bounds, K, n, (below, above) = bounds_of(plant), len(runs.steps), len(plant.system.states), room
    references = np.hstack([window.states[:K], window.inputs[:K]]).T
    for i, (name, reference, (left, right)) in enumerate(zip(plant.names, references, panels, strict=True)):
        step: Literal["post"] | None = None if i < n else "post"
        drawstyle = "default" if i < n else "steps-post"
        for axes, off in ((left, np.zeros(K)), (right, reference)):
            around = reference - off
            axes.fill_between(runs.steps, around - below[i], around + above[i], step=step, **_TUBE)
            ends = runs[f"{name}_lowest"] - off, runs[f"{name}_highest"] - off
            axes.fill_between(runs.steps, *ends, step=step, **_RANGE | {"label": f"range of {count} runs"})
            axes.plot(runs.steps, around, drawstyle=drawstyle, **_FOLLOWED)
        for r, run in enumerate(single):
            label = "" if r else "single runs"
            right.plot(runs.steps, run[name] - reference, drawstyle=drawstyle, label=label, **_SINGLE)
        pad_limits(left, Interval(float(np.nanmin(reference - below[i])), float(np.nanmax(reference + above[i]))))
        shade_outside(left, bounds.get(name))
        pad_limits(right, Interval(-below[i], above[i]))
        _shade_beyond(right, runs.steps, reference, bounds.get(name))
    panels[0, 1].set_title("minus the reference")
    return legend_above(figure)


def _shade_beyond(axes: Axes, steps: Array, reference: Array, bounds: Interval | None) -> None:
    """Draw the bounds minus the reference as lines, and shade the area beyond them, within the panel's limits."""
    if bounds is None:
        return
    for bound, end in zip((bounds.lower, bounds.upper), axes.get_ylim(), strict=True):
        beyond = bound - reference
        axes.plot(steps, beyond, **BOUND)
        outside = np.minimum(beyond, end) if bound == bounds.lower else np.maximum(beyond, end)
        axes.fill_between(steps, beyond, outside, **OUTSIDE)
