"""The closed loop over time: states and inputs, the optimal cost, and where a reference cannot be followed."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackable.arrays import Array
from trackable.control.loop_trajectory import LoopTrajectory
from trackable.plots.style import BLUE, FAINT, GREEN, GREY, INK, ORANGE, PAGE, PALE, direct_label, step_label, styled
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.sets.interval import Interval

Courses = Mapping[str, LoopTrajectory]
"""By initial state."""

STARTS: Final[dict[str, dict[str, Any]]] = {
    "on": {"color": GREEN, "linestyle": "-", "linewidth": 2.2, "zorder": 3.0, "label": "from the reference"},
    "above": {"color": ORANGE, "linestyle": (0, (5, 1.4)), "linewidth": 1.2, "zorder": 3.2, "label": "from above it"},
    "below": {"color": BLUE, "linestyle": (0, (1.4, 1)), "linewidth": 1.4, "zorder": 3.3, "label": "from below it"},
}
_REFERENCE: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.7, "zorder": 3.6, "label": "reference"}
_NO_PLAN: Final[dict[str, Any]] = {
    "facecolor": PALE,
    "edgecolor": "none",
    "alpha": 0.6,
    "zorder": 1,
    "label": "no plan",
}
_OFFERED: Final[dict[str, Any]] = {"linestyle": "none", "clip_on": False, "zorder": 5}
_OFFERS: Final[dict[float, dict[str, Any]]] = {
    1.0: {**_OFFERED, "marker": "v", "color": BLUE, "markersize": 5, "label": "new reference taken"},
    0.0: {**_OFFERED, "marker": "x", "color": ORANGE, "markersize": 5, "label": "not taken"},
}
_ROOM: Final = 0.12
_ROUNDING: Final = 1e-16


@styled
def closed_loop(courses: Mapping[str, Courses], plant: ConstrainedSystem, shown: int) -> Figure:
    """States and inputs up to step `shown`, a column for each reference; grey where from no start there is a plan."""
    names = (*plant.system.states, *plant.system.inputs)
    figure = Figure(figsize=(PAGE, 0.9 + 1.25 * len(names)))
    panels = figure.subplots(len(names), len(courses), sharex=True, sharey="row", squeeze=False)
    for column, (reference, by_start) in zip(panels.T, courses.items(), strict=True):
        column[0].set_title(f"{reference} reference")
        column[-1].set_xlabel(step_label(plant.sampling_time))
        for i, axes in enumerate(column):
            for start, course in by_start.items():
                _coordinate(axes, course.until(shown), i, STARTS[start])
            _where_no_plan(axes, by_start, shown, axes is column[0])
    for i, (name, row) in enumerate(zip(names, panels, strict=True)):
        row[0].set_ylabel(name)
        gone_through = [_values(c.until(shown), i)[0] for by_start in courses.values() for c in by_start.values()]
        _between(row[0], _bounds(plant).get(name), np.concatenate(gone_through))
        for axes in row[1:]:
            _grey_beyond(axes, _bounds(plant).get(name))
    panels[0, 0].set_xlim(0, shown)
    figure.align_ylabels(panels[:, 0])
    _legend(figure)
    return figure


@styled
def costs(courses: Mapping[str, Courses], plant: ConstrainedSystem, shown: int) -> Figure:
    """V(k) up to step `shown`, a panel for each reference; what is smaller than 1e-16 is rounding, and drawn there."""
    figure = Figure(figsize=(PAGE, 2.5))
    panels = figure.subplots(1, len(courses), sharey=True, squeeze=False)[0]
    for axes, (reference, by_start) in zip(panels, courses.items(), strict=True):
        for start, course in by_start.items():
            part = course.until(shown)
            axes.plot(part.steps, np.maximum(part.costs, _ROUNDING), **STARTS[start])
        _where_no_plan(axes, by_start, shown)
        axes.set(title=f"{reference} reference", xlabel=step_label(plant.sampling_time), xlim=(0, shown))
    panels[0].set(ylabel=r"optimal cost $V(k)$ [–]", yscale="log")
    _legend(figure)
    return figure


@styled
def infeasibility(course: LoopTrajectory, plant: ConstrainedSystem, horizon: int) -> Figure:
    """Around the first infeasible step: what the loop does, and the `horizon` steps for which no plan is left."""
    names, first = (*plant.system.states, *plant.system.inputs), float(course.infeasible[0])
    begin, end = max(0.0, first - horizon), first + 3 * horizon
    figure = Figure(figsize=(PAGE, 0.8 + 1.35 * len(names)))
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    part = course.until(int(end))
    for i, (axes, name) in enumerate(zip(panels, names, strict=True)):
        _coordinate(axes, part, i, STARTS["on"] | {"label": "closed loop"})
        _spans(axes, part.infeasible)
        values = _values(part, i)
        seen = part.steps >= begin
        near = np.concatenate([v[seen] for v in values])
        _limits(axes, Interval(float(np.nanmin(near)), float(np.nanmax(near))))
        _grey_beyond(axes, _bounds(plant).get(name))
        axes.set_ylabel(name)
        axes.axvline(first, color=INK, linewidth=0.8, linestyle=":", zorder=2.8)
        axes.axvline(first + horizon, color=INK, linewidth=0.8, linestyle=":", zorder=2.8)
    panels[0].annotate(
        "", (first, 1.04), (first + horizon, 1.04), xycoords=panels[0].get_xaxis_transform(),
        arrowprops={"arrowstyle": "<->", "linewidth": 0.7, "shrinkA": 0, "shrinkB": 0}, annotation_clip=False,
    )  # fmt: skip
    said = f" no plan for the steps {first:.0f} … {first + horizon:.0f}"
    where = panels[0].get_xaxis_transform()
    direct_label(panels[0], first + horizon, 1.04, said, transform=where, va="center", clip_on=False)
    panels[-1].set(xlabel=step_label(plant.sampling_time), xlim=(begin, min(end, part.steps[-1])))
    figure.align_ylabels(panels)
    _legend(figure)
    return figure


@styled
def relearned(course: LoopTrajectory, offered: Mapping[str, Array], plant: ConstrainedSystem) -> Figure:
    """A loop along references that are learned again: where one was taken over, and where it was not."""
    names = (*plant.system.states, *plant.system.inputs)
    figure = Figure(figsize=(PAGE, 0.8 + 1.35 * len(names)))
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for i, (axes, name) in enumerate(zip(panels, names, strict=True)):
        _coordinate(axes, course, i, STARTS["on"] | {"label": "closed loop"})
        _between(axes, _bounds(plant).get(name), _values(course, i)[0])
        axes.set_ylabel(name)
        for taken, looks in _OFFERS.items():
            steps = offered["step"][offered["taken"] == taken]
            if steps.size:
                axes.plot(steps, np.full(steps.size, 1.0), transform=axes.get_xaxis_transform(), **looks)
                axes.vlines(steps, 0, 1, transform=axes.get_xaxis_transform(), colors=GREY, linewidths=0.6, zorder=2)
    panels[-1].set(xlabel=step_label(plant.sampling_time), xlim=(0, course.steps[-1]))
    figure.align_ylabels(panels)
    _legend(figure)
    return figure


def _values(course: LoopTrajectory, i: int) -> tuple[Array, Array]:
    """The i-th of states and inputs, and of the reference's."""
    n = course.states.shape[1]
    if i < n:
        return course.states[:, i], course.reference_states[:, i]
    return course.inputs[:, i - n], course.reference_inputs[:, i - n]


def _coordinate(axes: Axes, course: LoopTrajectory, i: int, looks: dict[str, Any]) -> None:
    values, reference = _values(course, i)
    held: dict[str, Any] = {"drawstyle": "steps-post"} if i >= course.states.shape[1] else {}
    axes.plot(course.steps, values, **looks, **held)
    axes.plot(course.steps, reference, **_REFERENCE, **held)


def _where_no_plan(axes: Axes, by_start: Courses, shown: int, named: bool = True) -> None:
    """Steps at which no loop that goes on has a plan, and where the last one was given up."""
    ends = {start: float(course.steps[-1]) for start, course in by_start.items()}
    ended = max(ends.values())
    without = {start: set(course.infeasible.tolist()) for start, course in by_start.items()}
    steps = np.arange(min(ended, shown + 1.0))
    _spans(axes, np.array([k for k in steps if all(k in without[start] or k >= ends[start] for start in by_start)]))
    if ended < shown:
        axes.axvline(ended, color=GREY, linewidth=0.8, linestyle=":")
        if named:
            side = "right" if ended > shown / 2 else "left"
            where = axes.get_xaxis_transform()
            direct_label(axes, ended, 0.5, " given up ", transform=where, va="center", ha=side, color=GREY)


def _spans(axes: Axes, steps: Array) -> None:
    """Grey from each run of steps in a row to the step after it."""
    if not steps.size:
        return
    breaks = np.flatnonzero(np.diff(steps) > 1) + 1
    for first, end in pairwise([0, *breaks.tolist(), len(steps)]):
        axes.axvspan(steps[first], steps[end - 1] + 1, **_NO_PLAN)


def _bounds(plant: ConstrainedSystem) -> dict[str, Interval]:
    return {limit.name: limit.bounds for limit in plant.given_constraints}


def _between(axes: Axes, bounds: Interval | None, values: Array) -> None:
    """Limits that hold the bounds, or without any the `values`; grey beyond the bounds."""
    _limits(axes, bounds or Interval(float(np.nanmin(values)), float(np.nanmax(values))))
    _grey_beyond(axes, bounds)


def _limits(axes: Axes, held: Interval) -> None:
    room = _ROOM * held.width
    axes.set_ylim(held.lower - room, held.upper + room)


def _grey_beyond(axes: Axes, bounds: Interval | None) -> None:
    if bounds is None:
        return
    bottom, top = axes.get_ylim()
    for bound, beyond in ((bounds.lower, bottom), (bounds.upper, top)):
        if bottom < bound < top:
            axes.axhline(bound, color=INK, linewidth=0.8, zorder=2.5)
            axes.axhspan(*sorted((bound, beyond)), facecolor=FAINT, edgecolor="none", zorder=0)


def _legend(figure: Figure) -> None:
    """Each look once."""
    found = {
        label: handle for axes in figure.axes for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(found.values(), found, loc="outside upper center", ncols=len(found))
