"""The likelihood over two hyperparameters, and the set where all constraints hold."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from trackably.arrays import Array
from trackably.learning.landscape import Landscape
from trackably.learning.learned import Trace
from trackably.plots.style import FAINT, GREY, INK, PAGE, SYMBOLS, reference_styles, styled
from trackably.systems.reference import Reference

# Contours of l − min l, each about three times the one before.
_LEVELS: Final = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100, 300, 1000, 3000)
_LABEL: Final = 0.07
"""Room that the label of a contour needs to all sides, as a part of the panel."""
_NAME: Final = np.array([[0.05, 0.0], [0.1, 0.0], [0.15, 0.0], [0.2, 0.0]])
"""How far the name of an iteration reaches to the left, as parts of the panel."""
_KEYS: Final = (
    Line2D([], [], color=INK, marker=".", markersize=4, linewidth=0.8, label="iterations of Algorithm 1"),
    Patch(facecolor=FAINT, edgecolor=INK, linewidth=1.6, label="all constraints hold"),
    Line2D([], [], color=GREY, linewidth=0.6, label=r"$l(\theta) - \min l$"),
)
# One marker for each position, nested, so that optima that coincide are all visible.
_OPTIMUM_MARKERS: Final[tuple[dict[str, Any], ...]] = (
    {"marker": "D", "markersize": 4.5},
    {"marker": "s", "markersize": 4.5},
    {"marker": "o", "markersize": 8.5, "markerfacecolor": "none", "markeredgewidth": 1.4},
    {"marker": "^", "markersize": 12.5, "markerfacecolor": "none", "markeredgewidth": 1.2},
)


@styled
def landscape(panels: Sequence[Landscape], trace: Trace, references: Mapping[str, Reference]) -> Figure:
    """Draw objective and feasible set on each grid, the iterations of Algorithm 1, and the optimum of each reference.

    The grids span the first two hyperparameters of the trace. Others, if learned too, are not shown.
    """
    figure = Figure(figsize=(PAGE, 4.0))
    lowest = min(float(np.nanmin(panel.objective)) for panel in panels)
    names = list(trace.hyperparameters)[:2]
    path = np.array([trace.hyperparameters[name] for name in names])
    for axes, panel in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
        axes.set(xscale="log", yscale="log", xlim=panel.theta1[[0, -1]], ylim=panel.theta2[[0, -1]])
        axes.plot(*path, color=INK, marker=".", markersize=4, linewidth=0.8, zorder=4)
        optima = _optima(axes, references, names)
        _label_contours(axes, _contours(axes, panel, lowest), np.vstack([path.T, optima]))
        axes.set(xlabel=SYMBOLS.get(names[0], names[0]), ylabel=SYMBOLS.get(names[1], names[1]))
        for axis, values in ((axes.xaxis, panel.theta1), (axes.yaxis, panel.theta2)):
            axis.set_major_locator(LogLocator(subs=(1, 2, 5)) if values[-1] > 5 * values[0] else MaxNLocator(5))
            axis.set_minor_locator(NullLocator())
            axis.set_major_formatter("{x:g}")
    _name_ends(axes, path, trace.k_bar)
    figure.legend(handles=[*axes.get_legend_handles_labels()[0], *_KEYS], loc="outside upper center", ncols=3)
    return figure


def _contours(axes: Axes, panel: Landscape, lowest: float) -> QuadContourSet:
    """Draw contours of l above its lowest value, which are returned, and the feasible set shaded with its boundary."""
    grid = panel.theta1, panel.theta2
    axes.contourf(*grid, panel.margin, levels=[0, np.inf], colors=[FAINT], zorder=1)
    axes.contour(*grid, panel.margin, levels=[0], colors=[INK], linewidths=1.6, zorder=3)
    return axes.contour(*grid, panel.objective - lowest, levels=_LEVELS, colors=[GREY], linewidths=0.6, zorder=2)


def _label_contours(axes: Axes, lines: QuadContourSet, points: Array) -> None:
    """Label each contour where it is farthest from the frame, from the `points` (m, 2), and from other labels.

    The first of the points has its name on its left.
    """
    to_panel = axes.transData - axes.transAxes
    on_panel = np.asarray(to_panel.transform(points))
    taken, places = np.vstack([on_panel, on_panel[0] - _NAME]), []
    for level in lines.get_paths():
        vertices = np.asarray(level.vertices)
        if vertices.size:
            along = np.asarray(to_panel.transform(vertices))
            to_frame = np.min(np.minimum(along, 1 - along), axis=1)
            room = np.minimum(to_frame, np.min(np.linalg.norm(along[:, None] - taken, axis=2), axis=1))
            roomiest = int(np.argmax(room))
            if room[roomiest] > _LABEL:
                places.append(vertices[roomiest])
                taken = np.vstack([taken, along[roomiest]])
    axes.clabel(lines, fontsize=6, fmt="%g", manual=places)


def _optima(axes: Axes, references: Mapping[str, Reference], names: Sequence[str]) -> Array:
    """Mark the optimum of each reference, and return all of them, (r, 2)."""
    optima = []
    for (name, style), marker in zip(reference_styles(references).items(), cycle(_OPTIMUM_MARKERS)):
        theta = references[name].kernel_sums[0].kernel.hyperparameters
        label = f"optimum, {style['label']}"
        optima.append([float(theta[n]) for n in names])
        axes.plot(*optima[-1], linestyle="none", color=style["color"], zorder=5, label=label, **marker)
    return np.array(optima)


def _name_ends(axes: Axes, path: Array, k_bar: Array) -> None:
    """Write k̄ beside the first and the last iteration."""
    style: dict[str, Any] = {
        "fontsize": 7,
        "zorder": 6,
        "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 0.5},
    }
    for i, offset, ha, va in ((0, (-7, 0), "right", "center"), (-1, (0, 9), "center", "bottom")):
        name = rf"$\bar{{k}}$ = {k_bar[i]:g}"
        axes.annotate(name, (path[0, i], path[1, i]), offset, textcoords="offset points", ha=ha, va=va, **style)
