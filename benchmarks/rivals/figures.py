"""Figures: what is broken between grid points against the time spent, and errors as a bound is drawn in."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.rivals.study.draws import LEVELS
from benchmarks.rivals.study.summary import TIGHTNESS, Entry
from benchmarks.rivals.table import Row
from trackably.exports.figures import INK, PAGE, styled

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


@styled
def study(entries: Sequence[Entry]) -> Figure:
    """For each system: median errors with their bands, and the shares of curves that break bounds or collapsed."""
    systems, rivals = (
        list(dict.fromkeys(names)) for names in zip(*[(e.system, e.rival) for e in entries], strict=True)
    )
    figure = Figure(figsize=(PAGE, 5.4))
    axes = figure.subplots(3, len(systems), sharex=True, sharey="row", squeeze=False)
    for column, system in enumerate(systems):
        for i, rival in enumerate(rivals):
            shown = [e for e in entries if (e.system, e.rival, e.factor) == (system, rival, TIGHTNESS)]
            _against_tightness(axes[:, column], shown, i)
        axes[0, column].set_title(system, fontsize=7)
        axes[0, column].set_yscale("log")
        axes[2, column].set_xticks(range(len(LEVELS)), [level.replace(" ", "\n") for level in LEVELS], fontsize=5)
    for row, said in zip(
        axes, ("median error /\nspread", "bounds broken\n(part of runs)", "collapsed\n(part of runs)"), strict=True
    ):
        row[0].set_ylabel(said, fontsize=6)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=6)
    return figure


def _against_tightness(axes: Sequence[Axes], entries: Sequence[Entry], i: int) -> None:
    """Draw one rival, without the levels in which it never has a curve."""
    style = {"color": f"C{i}", "marker": _MARKERS[i], "markersize": 3, "linewidth": 0.8}
    places = [LEVELS.index(entry.level) + 0.06 * (i - 3.5) for entry in entries]
    known = [(x, e) for x, e in zip(places, entries, strict=True) if e.error is not None]
    axes[0].plot([x for x, _ in known], [e.error for _, e in known], label=entries[0].rival if entries else "", **style)
    axes[0].vlines([x for x, _ in known], [e.lower for _, e in known], [e.upper for _, e in known], color=f"C{i}")
    some = [(x, e) for x, e in zip(places, entries, strict=True) if e.infeasible + e.failed < e.runs]
    axes[1].plot([x for x, _ in some], [e.violated / e.runs for _, e in some], **style)
    axes[2].plot([x for x, _ in some], [e.collapsed / e.runs for _, e in some], **style)


_SOLVED = 1e-9  # a solver's tolerance


def _tightness(row: Row) -> float:
    return float(row.tightness or 0.0)
