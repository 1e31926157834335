"""Disturbed loops: the tube around a reference, controllers side by side, and what room for disturbances costs."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackably.arrays import Array
from trackably.control.loop_trajectory import LoopTrajectory, Runs
from trackably.plots.panels import (
    UNKNOWN_UNITS,
    Units,
    axis_label,
    bounds_of,
    coordinates,
    shade_no_plan,
    shade_outside,
)
from trackably.plots.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    NAVY,
    ORANGE,
    PAGE,
    legend_above,
    step_label,
    styled,
)
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Window
from trackably.systems.sets.interval import Interval
from trackably.systems.sets.polytope import Polytope

_KINDS: Final[dict[str, dict[str, Any]]] = {
    "drawn": {"color": GREEN, "linestyle": "-", "linewidth": 2.0, "zorder": 3.0, "label": "drawn disturbances"},
    "greedy": {"color": ORANGE, "linestyle": (0, (5, 1.4)), "linewidth": 1.2, "zorder": 3.2, "label": "greedy ones"},
    "constant": {"color": BLUE, "linestyle": (0, (1.4, 1)), "linewidth": 1.4, "zorder": 3.3, "label": "constant ones"},
}
_TUBE: Final[dict[str, Any]] = {"facecolor": BLUE, "alpha": 0.16, "edgecolor": "none", "zorder": 1.5, "label": "tube"}
_RANGE: Final[dict[str, Any]] = {"facecolor": BLUE, "alpha": 0.34, "edgecolor": "none", "zorder": 1.6}
_REFERENCE: Final[dict[str, Any]] = {"color": ORANGE, "linewidth": 1.3, "zorder": 3.4, "label": "reference"}
_SINGLE: Final[dict[str, Any]] = {"color": NAVY, "linewidth": 0.4, "zorder": 3}
_NAMED: Final[tuple[dict[str, Any], ...]] = (
    {"color": ORANGE, "marker": "D", "markersize": 6, "linestyle": "none", "zorder": 4},
    {"color": NAVY, "marker": "s", "markersize": 6, "linestyle": "none", "zorder": 4},
)
_SHOWN: Final = (-0.03, 0.12)
"""Margins between these parts of a width are shown, and larger ones where no loop comes so near."""


@styled
def tube_runs(
    runs: Runs,
    count: int,
    window: Window,
    room: tuple[Array, Array],
    plant: ConstrainedSystem,
    units: Units = UNKNOWN_UNITS,
) -> Figure:
    """Draw the tube around a reference, and runs of the disturbed system inside of it.

    On the left over time, on the right as differences from the reference, between the distances of the bounds. `room`
    is how far states and inputs may be below and above the reference, each (n + m,). The range of all `count` runs is
    shaded, and single ones are drawn.
    """
    names, bounds = coordinates(plant), bounds_of(plant)
    figure = Figure(figsize=(PAGE, 0.9 + 1.25 * len(names)))
    panels = figure.subplots(len(names), 2, sharex=True, squeeze=False)
    K, n, (below, above) = len(runs.steps), len(plant.system.states), room
    for i, (name, (left, right)) in enumerate(zip(names, panels, strict=True)):
        reference = window.states[:K, i] if i < n else window.inputs[:K, i - n]
        step: dict[str, Any] = {"step": "post"} if i >= n else {}
        style: dict[str, Any] = {"drawstyle": "steps-post"} if i >= n else {}
        for axes, off in ((left, np.zeros(K)), (right, reference)):
            around = reference - off
            axes.fill_between(runs.steps, around - below[i], around + above[i], **_TUBE, **step)
            ends = runs.lowest[:, i] - off, runs.highest[:, i] - off
            axes.fill_between(runs.steps, *ends, label=f"range of {count} runs", **_RANGE, **step)
            axes.plot(runs.steps, around, **_REFERENCE, **style)
        for r, values in enumerate(runs.single):
            right.plot(runs.steps, values[:, i] - reference, **_SINGLE, **style, label="" if r else "single runs")
        _limit(left, np.concatenate([reference - below[i], reference + above[i]]), 0.06)
        shade_outside(left, bounds.get(name))
        _limit(right, np.array([-below[i], above[i]]), 0.25)
        _shade_beyond(right, runs.steps, reference, bounds.get(name))
        left.set_ylabel(axis_label(name, units))
    panels[0, 1].set_title("minus the reference")
    for axes in panels[-1]:
        axes.set(xlabel=step_label(plant.sampling_time), xlim=(runs.steps[0], runs.steps[-1]))
    figure.align_ylabels(panels[:, 0])
    legend_above(figure)
    return figure


@styled
def disturbed_loops(
    loops: Mapping[str, Mapping[str, LoopTrajectory]], failures: Mapping[str, float | None], plant: ConstrainedSystem
) -> Figure:
    """Draw the smallest margins of states and inputs, one column for each pair of controller and reference by label.

    Loops are by kind of disturbance. Margins are parts of a width, and negative where a bound is broken; large ones are
    cut off. `failures` are the first steps without a plan or outside of the bounds, by the same labels. Steps are
    shaded where no loop of a column has a plan.
    """
    figure = Figure(figsize=(PAGE, 3.4))
    panels = figure.subplots(2, len(loops), sharex=True, sharey="row", squeeze=False)
    last = max(course.steps[-1] for by_kind in loops.values() for course in by_kind.values())
    for column, (label, by_kind) in zip(panels.T, loops.items(), strict=True):
        column[0].set_title(f"{label}:\n{_verdict(failures[label])}")
        column[-1].set_xlabel(step_label(plant.sampling_time))
        lost = set.intersection(*(set(course.infeasible.tolist()) for course in by_kind.values()))
        for kind, course in by_kind.items():
            for axes, values in zip(column, _margins(course, plant), strict=True):
                axes.plot(course.steps, values, **_KINDS[kind])
        for axes in column:
            shade_no_plan(axes, np.array(sorted(lost)))
            axes.axhspan(_SHOWN[0], 0, facecolor=FAINT, edgecolor="none", zorder=0)
            axes.axhline(0, color=INK, linewidth=0.8, zorder=2.5)
            if (first := failures[label]) is not None:
                axes.axvline(first, color=INK, linewidth=0.8, linestyle=":", zorder=2.8)
    every = [_margins(course, plant) for by_kind in loops.values() for course in by_kind.values()]
    for axes, name, of_all in zip(panels[:, 0], ("states", "inputs"), zip(*every, strict=True), strict=True):
        most = max(float(np.nanmin(of)) for of in of_all)
        axes.set(ylabel=f"smallest margin\nof {name} / width [–]", ylim=(_SHOWN[0], max(_SHOWN[1], 1.25 * most)))
    panels[0, 0].set_xlim(0, last)
    legend_above(figure)
    return figure


@styled
def price_of_room(
    sizes: Sequence[float],
    price: Sequence[float],
    misfit: Sequence[float],
    named: Mapping[float, str],
    misfit_unit: str | None = None,
) -> Figure:
    """Draw price and misfit of robust references over the size of the disturbance sets; some sizes are `named`.

    Sizes are relative to the sets that are given. A misfit may have a unit, if `misfit_unit` names one.
    """
    figure = Figure(figsize=(PAGE, 2.8))
    unit = f" [{misfit_unit}]" if misfit_unit else ""
    labels = (r"price $J - \min l$ [–]", f"misfit of the samples{unit}")
    for axes, values, label in zip(figure.subplots(1, 2), (price, misfit), labels, strict=True):
        axes.plot(sizes, values, color=GREEN, marker="o", markersize=3.5, linewidth=1.4)
        for (size, name), style in zip(named.items(), cycle(_NAMED)):
            axes.plot(size, values[list(sizes).index(size)], **style, label=name)
        axes.margins(x=0.1, y=0.12)
        axes.set(xlabel="disturbance sets / those given [–]", ylabel=label)
        axes.set_ylim(0)
    legend_above(figure)
    return figure


def _limit(axes: Axes, values: Array, padding: float) -> None:
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    by = padding * (high - low or 1.0)
    axes.set_ylim(low - by, high + by)


def _shade_beyond(axes: Axes, steps: Array, reference: Array, bounds: Interval | None) -> None:
    """Draw where the bounds are, seen from the reference, as far as the panel shows them."""
    if bounds is None:
        return
    for bound, end in zip((bounds.lower, bounds.upper), axes.get_ylim(), strict=True):
        beyond = bound - reference
        axes.plot(steps, beyond, color=INK, linewidth=0.8, zorder=2.5)
        outside = np.minimum(beyond, end) if bound == bounds.lower else np.maximum(beyond, end)
        axes.fill_between(steps, beyond, outside, facecolor=FAINT, edgecolor="none", zorder=0)


def _margins(course: LoopTrajectory, plant: ConstrainedSystem) -> tuple[Array, Array]:
    """Return the smallest margins of states and inputs over the steps, as parts of the widths."""
    return _margin(plant.state_set, course.states), _margin(plant.input_set, course.inputs)


def _margin(bounded: Polytope, points: Array) -> Array:
    """Return the smallest distance to a bound at each point (K, n), as a part of the width: shape (K,)."""
    values, widths = points @ bounded.rows.T, bounded.widths
    return np.asarray(np.min(np.minimum(values - bounded.lower, bounded.upper - values) / widths, axis=1))


def _verdict(first_failure: float | None) -> str:
    """Return what becomes of loops, for a title: inside the panel it would hide curves."""
    return "never fails" if first_failure is None else f"fails at step {first_failure:.0f}"
