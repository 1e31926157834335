"""Figures: what is broken between grid points against the time spent, and errors as a bound is drawn in."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from benchmarks.rivals.table import Row
from trackable.plots.style import INK, PAGE, styled

_MARKERS = "osD^vP*X<>"
_NOTHING = 1e-13  # where "none" is drawn, on a logarithmic axis


@styled
def violations(rows: Sequence[Row]) -> Figure:
    """Each marker is one fineness of the grid; below the line nothing is broken, and that is proved."""
    figure = Figure(figsize=(PAGE, 2.6))
    axes = figure.add_subplot()
    for i, name in enumerate(dict.fromkeys(row.rival for row in rows)):
        found = [row for row in rows if row.rival == name and row.least is not None and row.seconds is not None]
        heights = [row.least if row.least else _NOTHING for row in found]
        axes.plot([row.seconds for row in found], heights, marker=_MARKERS[i], markersize=4, linewidth=0.8, label=name)
    axes.axhline(10 * _NOTHING, color=INK, linewidth=0.6)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("processor time [s]")
    axes.set_ylabel("largest violation / width of the bound\n(below the line: none, proved)")
    figure.legend(loc="outside right upper", fontsize=6)
    return figure


@styled
def tightness(rows: Sequence[Row]) -> Figure:
    """The error to the truth as the upper bound of the state is drawn in; an open marker breaks its bounds."""
    figure = Figure(figsize=(PAGE, 2.8))
    axes = figure.add_subplot()
    shown = [row for row in rows if row.tightness is not None and row.error is not None]
    for i, name in enumerate(dict.fromkeys(row.rival for row in shown)):
        found = sorted((row for row in shown if row.rival == name), key=_tightness)
        colour, marker = f"C{i}", _MARKERS[i % len(_MARKERS)]
        axes.plot([_tightness(row) for row in found], [row.error for row in found], linewidth=0.8, color=colour)
        axes.plot([], [], marker=marker, markersize=4, linewidth=0.8, color=colour, label=name)
        for row in found:
            face = colour if (row.least or 0.0) < _SOLVED else "none"
            axes.plot([_tightness(row)], [row.error], marker=marker, color=colour, mfc=face, markersize=4)
    axes.set_xscale("log")
    axes.set_yscale("log")
    ticks = sorted({_tightness(row) for row in shown})
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.set_xlabel("upper bound of the state (Example 1); open: bounds are broken")
    axes.set_ylabel("error to the truth / spread of the samples")
    figure.legend(loc="outside right upper", fontsize=6)
    return figure


_SOLVED = 1e-9  # a solver's tolerance


def _tightness(row: Row) -> float:
    return float(row.tightness or 0.0)
