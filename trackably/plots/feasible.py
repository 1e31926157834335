"""The feasible set of a controller, for several horizons."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackably.arrays import Array
from trackably.control.loop_trajectory import LoopTrajectory
from trackably.plots.panels import INITIAL_STATE_STYLES, UNKNOWN_UNITS, Units, axis_label
from trackably.plots.style import BLUE, COLUMN, GREEN, INK, NAVY, ORANGE, PAGE, PURPLE, step_label, styled
from trackably.systems.constrained import ConstrainedSystem

Columns = Mapping[str, Array]

# From the shortest horizon to the longest. Wider bands lie below, and their edges differ in dashes too.
_EDGE_STYLES: Final[tuple[dict[str, Any], ...]] = (
    {"color": NAVY, "linestyle": "-"},
    {"color": ORANGE, "linestyle": (0, (5, 1.4))},
    {"color": GREEN, "linestyle": (0, (5, 1.4, 1.2, 1.4))},
    {"color": PURPLE, "linestyle": (0, (1.4, 1))},
    {"color": BLUE, "linestyle": (0, (3, 1, 1, 1, 1, 1))},
)
_FILL: Final = 0.12


@styled
def feasible_intervals(
    feasible: Mapping[int, Columns], trajectory: LoopTrajectory, plant: ConstrainedSystem, units: Units = UNKNOWN_UNITS
) -> Figure:
    """Draw the feasible interval of each horizon over the steps, for systems of one state, and the reference."""
    figure = Figure(figsize=(PAGE, 2.9))
    axes = figure.subplots()
    for (horizon, columns), style in _widest_first(feasible):
        k, low, high = columns["step"], columns["lower"], columns["upper"]
        axes.fill_between(k, low, high, facecolor=style["color"], alpha=_FILL, edgecolor="none", zorder=1)
        axes.plot(k, low, **style, label=rf"$N$ = {horizon}", zorder=3)
        axes.plot(k, high, **style, zorder=3)
    last = max(columns["step"][-1] for columns in feasible.values())
    part = trajectory.until(int(last))
    axes.plot(part.steps, part.reference_states[:, 0], color=INK, linewidth=0.7, zorder=4, label="reference")
    for bound in (plant.state_set.lower[0], plant.state_set.upper[0]):
        axes.axhline(bound / plant.state_set.rows[0, 0], color=INK, linewidth=0.8, zorder=2.5)
    name = axis_label(plant.system.states[0], units)
    axes.set(xlabel=step_label(plant.sampling_time), ylabel=name, xlim=(0, last))
    _legend(figure, axes)
    return figure


@styled
def feasible_polygons(
    feasible: Mapping[int, Columns],
    by_initial_state: Mapping[str, LoopTrajectory],
    plant: ConstrainedSystem,
    units: Units = UNKNOWN_UNITS,
) -> Figure:
    """Draw the feasible polygon of each horizon at step 0, for systems of two states, and the loops' first steps."""
    first, second = plant.system.states
    figure = Figure(figsize=(1.4 * COLUMN, 3.6))
    axes = figure.subplots()
    for (horizon, columns), style in _widest_first(feasible):
        corners = np.column_stack([columns[first], columns[second]])
        axes.fill(*corners.T, facecolor=style["color"], alpha=_FILL, edgecolor="none", zorder=1)
        axes.plot(*np.vstack([corners, corners[:1]]).T, **style, label=rf"$N$ = {horizon}", zorder=3)
    everything = np.vstack([np.column_stack([c[first], c[second]]) for c in feasible.values()])
    for initial_state, trajectory in by_initial_state.items():
        x = trajectory.until(max(feasible)).states
        axes.plot(x[:, 0], x[:, 1], **INITIAL_STATE_STYLES[initial_state] | {"color": INK, "linewidth": 1.0})
        axes.plot(*x[0], "o", color=INK, zorder=5)
    padding = 0.06 * np.ptp(everything, axis=0)
    (left, bottom), (right, top) = everything.min(axis=0) - padding, everything.max(axis=0) + padding
    axes.set(xlabel=axis_label(first, units), ylabel=axis_label(second, units))
    axes.set(xlim=(left, right), ylim=(bottom, top))
    _legend(figure, axes, 3)
    return figure


def _widest_first(feasible: Mapping[int, Columns]) -> list[tuple[tuple[int, Columns], dict[str, Any]]]:
    ordered = sorted(feasible.items())
    return list(zip(ordered, (_EDGE_STYLES * len(ordered))[: len(ordered)], strict=True))[::-1]


def _legend(figure: Figure, axes: Axes, columns: int = 6) -> None:
    """Write a legend of the horizons, the shortest first, and then of the rest."""
    handles, labels = axes.get_legend_handles_labels()
    horizons = sum(label.startswith("$N$") for label in labels)
    order = [*range(horizons)[::-1], *range(horizons, len(labels))]
    found = {labels[i]: handles[i] for i in order}
    figure.legend(found.values(), found, loc="outside upper center", ncols=min(columns, len(found)))
