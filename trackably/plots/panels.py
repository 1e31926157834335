"""What panels over time have in common: coordinates with their units, bounds, and steps without a plan."""

import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackably.arrays import Array
from trackably.control.loop_trajectory import LoopTrajectory
from trackably.plots.style import BLUE, FAINT, GREEN, INK, ORANGE, PAGE, PALE
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.sets.interval import Interval

Units = Mapping[str, str]
"""Units by the names of states and inputs."""

UNKNOWN_UNITS: Final[Units] = MappingProxyType({})

INITIAL_STATE_STYLES: Final[dict[str, dict[str, Any]]] = {
    "on": {"color": GREEN, "linestyle": "-", "linewidth": 2.2, "zorder": 3.0, "label": "from the reference"},
    "above": {"color": ORANGE, "linestyle": (0, (5, 1.4)), "linewidth": 1.2, "zorder": 3.2, "label": "from above it"},
    "below": {"color": BLUE, "linestyle": (0, (1.4, 1)), "linewidth": 1.4, "zorder": 3.3, "label": "from below it"},
}
"""By the names that `pipeline.loops.initial_states` gives."""

CLOSED_LOOP: Final = INITIAL_STATE_STYLES["on"] | {"label": "closed loop"}
_REFERENCE: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.7, "zorder": 3.6, "label": "reference"}
_NO_PLAN: Final[dict[str, Any]] = {
    "facecolor": PALE,
    "edgecolor": "none",
    "alpha": 0.6,
    "zorder": 1,
    "label": "no plan",
}
_PADDING: Final = 0.12


def coordinates(plant: ConstrainedSystem) -> tuple[str, ...]:
    """Return the names of the states, then those of the inputs."""
    return (*plant.system.states, *plant.system.inputs)


def axis_label(name: str, units: Units) -> str:
    """Return the label of an axis: the name of a state, an input or a sum of some, with its unit where it is known.

    A sum has a unit if all of its terms have the same one.
    """
    summed = re.sub(r" \(\d+\)$", "", name)  # equal names are numbered
    terms = [summed] if summed in units else [term for term in re.split("[+*-]", summed) if not term[:1].isdigit()]
    found = {units.get(term) for term in terms if term}
    unit = found.pop() if len(found) == 1 else None
    return name.replace("_", " ") + (f" [{unit}]" if unit else "")


def stacked_panels(names: Sequence[str], base_height: float, units: Units) -> tuple[Figure, NDArray[Any]]:
    """Return a figure with one labelled panel below the other for each name."""
    figure = Figure(figsize=(PAGE, base_height + 1.35 * len(names)))
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for axes, name in zip(panels, names, strict=True):
        axes.set_ylabel(axis_label(name, units))
    return figure, panels


def coordinate_values(trajectory: LoopTrajectory, i: int) -> tuple[Array, Array]:
    """Return the values of the i-th coordinate (states, then inputs), and those of the reference."""
    n = trajectory.states.shape[1]
    if i < n:
        return trajectory.states[:, i], trajectory.reference_states[:, i]
    return trajectory.inputs[:, i - n], trajectory.reference_inputs[:, i - n]


def draw_coordinate(axes: Axes, trajectory: LoopTrajectory, i: int, style: dict[str, Any]) -> None:
    """Draw the i-th coordinate of a loop and of its reference; inputs are constant between steps."""
    values, reference = coordinate_values(trajectory, i)
    held: dict[str, Any] = {"drawstyle": "steps-post"} if i >= trajectory.states.shape[1] else {}
    axes.plot(trajectory.steps, values, **style, **held)
    axes.plot(trajectory.steps, reference, **_REFERENCE, **held)


def shade_no_plan(axes: Axes, steps: Array) -> None:
    """Shade each run of consecutive steps, up to the step after it."""
    if not steps.size:
        return
    breaks = np.flatnonzero(np.diff(steps) > 1) + 1
    for first, end in pairwise([0, *breaks.tolist(), len(steps)]):
        axes.axvspan(steps[first], steps[end - 1] + 1, **_NO_PLAN)


def bounds_of(plant: ConstrainedSystem) -> dict[str, Interval]:
    """Return the bounds of a plant by the name of what they bound."""
    return {c.name: c.bounds for c in plant.given_constraints}


def fit_limits(axes: Axes, bounds: Interval | None, values: Array) -> None:
    """Let the panel show the bounds, or all `values` where there are none; shade what is outside the bounds."""
    pad_limits(axes, bounds or Interval(float(np.nanmin(values)), float(np.nanmax(values))))
    shade_outside(axes, bounds)


def pad_limits(axes: Axes, shown: Interval) -> None:
    """Let the panel show an interval and a little more."""
    padding = _PADDING * shown.width
    axes.set_ylim(shown.lower - padding, shown.upper + padding)


def shade_outside(axes: Axes, bounds: Interval | None) -> None:
    """Draw each bound within the panel's limits as a line, and shade what is outside."""
    if bounds is None:
        return
    bottom, top = axes.get_ylim()
    for bound, end in ((bounds.lower, bottom), (bounds.upper, top)):
        if bottom < bound < top:
            axes.axhline(bound, color=INK, linewidth=0.8, zorder=2.5)
            axes.axhspan(*sorted((bound, end)), facecolor=FAINT, edgecolor="none", zorder=0)
