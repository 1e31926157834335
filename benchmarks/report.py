"""Write the measured rows as JSON, as a table in Markdown and as a figure."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from benchmarks.harness import Row
from benchmarks.rivals.tables import known, markdown
from pipeline.drawings.style import save
from trackably.exports.figures import BLUE, FAINT, INK, ORANGE, PALE, panels_of, with_style

FOLDER = Path(__file__).parent
RESULTS, TABLE, FIGURE = FOLDER / "results.json", FOLDER / "README.md", FOLDER / "figures" / "ratios.svg"

_HEAD = ("problem", "beside", "this", "other", "ratio", "target", "")

_INTRODUCTION = """# What it costs

Written by `make bench`. Each row compares two ways to the same answer, which is checked before anything is timed: short
bursts of one and the other in turns, in one process, in seconds of processor time on one thread (what a clock shows
on a machine with nothing else to do). Ratios are medians, with their range over the rounds. **×** says how many times
longer the other one takes; **of** says what part of the other's time or size is needed.
"""

_ABOUT = {
    "likelihood and gradient": """Samples at random times, ten in a second, of a squared exponential with a length scale
of 0.7 s: the more there are, the longer they last. The covariance matrix is factored in cosines and sines, or, of many
samples, as a band; in rows called *whole matrix* it is factored as it is.""",
    "defaults alone": """`learn_reference` with samples, plant, kernel and claim, and nothing else. Every fifth sample
is left out, and the best of three programs, whose smoothness weights are a decade apart, is chosen by what they say of
the samples that are left out.""",
    "constrained fit": """Where a start is said to be handed over, the other one begins where our own search for starts,
which is part of our time, leads to.""",
}


def write(rows: Sequence[Row], machine: dict[str, str]) -> None:
    """Write the JSON, the table and the figure."""
    write_rows(rows, machine)
    TABLE.write_text(table(rows, machine), "utf-8")
    save(figure([row for row in rows if not (row.at_most or row.failure)]), FIGURE)


def write_rows(rows: Sequence[Row], machine: dict[str, str]) -> None:
    """Write the JSON only. It is called after each row, so that an interrupted run loses no measured row."""
    measured = {"machine": machine, "rows": [*map(known, rows)]}
    RESULTS.write_text(json.dumps(measured, indent=1, ensure_ascii=False) + "\n", "utf-8")


def table(rows: Sequence[Row], machine: dict[str, str]) -> str:
    """Return the table in Markdown."""
    lines = [_INTRODUCTION, "![Ratios](figures/ratios.svg)", "", *_missed(rows)]
    for topic in dict.fromkeys(row.topic for row in rows):
        lines += [f"## {topic[0].upper()}{topic[1:]}", ""]
        lines += [_ABOUT[topic], ""] if topic in _ABOUT else []
        lines += [markdown(_HEAD, "llrrrrl", [_cells(row) for row in rows if row.topic == topic]), ""]
    lines += ["## Machine", "", *(f"- {name}: {value}" for name, value in machine.items()), ""]
    return "\n".join(lines)


def _missed(rows: Sequence[Row]) -> list[str]:
    wanted = [row for row in rows if row.target is not None]
    missed = [row for row in wanted if row.verdict == "missed"]
    lines = [f"{len(wanted) - len(missed)} of {len(wanted)} targets are met." + (" Missed:" if missed else ""), ""]
    lines += [f"{_named(row)}, not {_target(row)}" for row in missed]
    failed = [f"- {row.topic}, {row.problem}, beside {row.rival}: {row.failure}" for row in rows if row.failure]
    lines += ["", "Without a comparison, as one of both failed or they disagree:", "", *failed] if failed else []
    slower = [row for row in rows if not (row.verdict or row.at_most) and row.ratio < 1]
    lines += ["", "Slower than the other, where no target was set:", "", *map(_named, slower)] if slower else []
    return [*lines, ""]


def _named(row: Row) -> str:
    return f"- {row.topic}, {row.problem}, beside {row.rival}: {_ratio(row)}"


def _cells(row: Row) -> list[str]:
    verdict = row.verdict if row.verdict in ("met", "") else f"**{row.verdict}**"
    last = "; ".join(part for part in (verdict, row.failure, row.note) if part)
    return [row.problem, row.rival, _time(row.seconds), _time(row.rival_seconds), _ratio(row), _target(row), last]


def _ratio(row: Row) -> str:
    if row.failure:
        return ""
    around = "" if row.lowest == row.highest else f" ({row.lowest:.3g} … {row.highest:.3g})"
    return f"{row.ratio:.3g}{around} of" if row.at_most else f"{row.ratio:.3g}{around} ×"


def _target(row: Row) -> str:
    if row.target is None:
        return ""
    return f"≤ {row.target:g} of" if row.at_most else f"≥ {row.target:g} ×"


def _time(seconds: float) -> str:
    if math.isnan(seconds):
        return ""
    unit, size = next((of for of in (("s", 1.0), ("ms", 1e-3)) if seconds >= of[1]), ("µs", 1e-6))
    return f"{seconds / size:.3g} {unit}"


@with_style
def figure(rows: Sequence[Row]) -> Figure:
    """Draw how many times longer others take, with the range over the rounds, and the targets."""
    figure, [[axes]] = panels_of(0.5 + 0.155 * len(rows))
    for place, row in enumerate(reversed(rows)):
        axes.axhline(place, color=FAINT, linewidth=0.5, zorder=0)
        if row.target is not None:
            axes.plot([row.target] * 2, [place - 0.5, place + 0.5], color=PALE, linewidth=2.5, solid_capstyle="butt")
        # Missed targets differ in shape too, for readers who cannot see the colours.
        missed = row.verdict == "missed"
        looks = {"color": ORANGE, "marker": "s"} if missed else {"color": BLUE, "marker": "o"}
        axes.plot([row.lowest, row.highest], [place, place], color=INK, linewidth=0.8)
        axes.plot([row.ratio], [place], markersize=4, linestyle="none", **looks)
    axes.set_xscale("log")
    axes.axvline(1.0, color=INK, linewidth=0.6, zorder=0)
    labels = [f"{row.topic}, {row.problem}: {row.rival}" for row in reversed(rows)]
    axes.set_yticks(range(len(rows)), labels, fontsize=5.5)
    axes.tick_params(axis="y", length=0)
    axes.set(ylim=(-0.7, len(rows) - 0.3), xlabel="other's time / ours (bar: target; square: missed)")
    return figure
