"""The page with its figures: what each rival promises, and what it did."""

from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.rivals import joints, pendulum, table
from benchmarks.rivals.model import Rival
from benchmarks.rivals.study import summary as study
from benchmarks.rivals.study.draws import LEVELS
from benchmarks.rivals.study.summary import TIGHTNESS, Entry
from benchmarks.rivals.table import Row
from benchmarks.rivals.tables import markdown, read
from pipeline.drawings.style import save
from trackably.exports.figures import INK, panels_of, with_style
from trackably.files import read_yaml

_MARKERS = "osD^vP*X<>"
_NOTHING = 1e-13  # where "none" is drawn, on a logarithmic axis


@with_style
def violations(rows: Sequence[Row]) -> Figure:
    """Each marker is one fineness of the grid; below the line nothing is broken, and that is proved."""
    figure, [[axes]] = panels_of(2.6)
    for i, name in enumerate(dict.fromkeys(row.rival for row in rows)):
        found = [row for row in rows if row.rival == name and row.least is not None and row.seconds is not None]
        heights = [row.least if row.least else _NOTHING for row in found]
        axes.plot([row.seconds for row in found], heights, marker=_MARKERS[i], markersize=4, linewidth=0.8, label=name)
    axes.axhline(10 * _NOTHING, color=INK, linewidth=0.6)
    axes.set(xscale="log", yscale="log", xlabel="processor time [s]")
    axes.set_ylabel("largest violation / width of the bound\n(below the line: none, proved)")
    figure.legend(loc="outside right upper", fontsize=6)
    return figure


@with_style
def tightness(rows: Sequence[Row]) -> Figure:
    """The error to the truth as the upper bound of the state is tightened; an open marker breaks its bounds."""
    figure, [[axes]] = panels_of(2.8)
    shown = [row for row in rows if row.tightness is not None and row.error is not None]
    for i, name in enumerate(dict.fromkeys(row.rival for row in shown)):
        found = sorted((row.tightness, row.error, row.least or 0.0) for row in shown if row.rival == name)
        bounds, errors, least = np.transpose(found)
        style = {"color": f"C{i}", "marker": _MARKERS[i % len(_MARKERS)], "markersize": 4, "linewidth": 0.8}
        axes.plot(bounds, errors, label=name, **style)
        broken = least >= _SOLVED
        axes.plot(bounds[broken], errors[broken], mfc="w", **style | {"linewidth": 0})
    axes.set(xscale="log", yscale="log", ylabel="error to the truth / spread of the samples")
    ticks = sorted({row.tightness for row in shown})
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.set_xlabel("upper bound of the state (Example 1); open: bounds are broken")
    figure.legend(loc="outside right upper", fontsize=6)
    return figure


_DRAWN: dict[str, Callable[[Entry], float | None]] = {
    "median error /\nspread": lambda of: of.error,
    "bounds broken\n(part of runs)": lambda of: of.violated / of.runs,
    "collapsed\n(part of runs)": lambda of: of.collapsed / of.runs,
}


@with_style
def errors(entries: Sequence[Entry]) -> Figure:
    """For each system: median errors with their bands, and the shares of curves that break bounds or collapsed.

    Levels in which a rival never has a curve are left out.
    """
    systems, rivals = (dict.fromkeys(names) for names in zip(*[(e.system, e.rival) for e in entries], strict=True))
    figure, axes = panels_of(5.4, 3, len(systems), sharex=True, sharey="row")
    for (row, (said, drawn)), (column, system) in product(enumerate(_DRAWN.items()), enumerate(systems)):
        for i, rival in enumerate(rivals):
            of = [e for e in entries if (e.system, e.rival, e.factor) == (system, rival, TIGHTNESS)]
            of = [e for e in of if e.infeasible + e.failed < e.runs and drawn(e) is not None]
            x, style = [LEVELS.index(e.level) + 0.06 * (i - 3.5) for e in of], {"color": f"C{i}", "linewidth": 0.8}
            axes[row, column].plot(x, [drawn(e) for e in of], label=rival, marker=_MARKERS[i], markersize=3, **style)
            if row == 0:
                axes[0, column].vlines(x, [e.lower for e in of], [e.upper for e in of], color=f"C{i}")
        axes[row, 0].set_ylabel(said, fontsize=6)
        axes[0, column].set_title(system, fontsize=7)
        axes[row, column].set_xticks(range(len(LEVELS)), [of.replace(" ", "\n") for of in LEVELS], fontsize=5)
    axes[0, 0].set_yscale("log")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=6)
    return figure


_SOLVED = 1e-9  # a solver's tolerance


FOLDER = Path(__file__).parent
RESULTS, PENDULUM, SWEEP = FOLDER / "results.json", FOLDER / "pendulum.json", FOLDER / "sweep.json"
STUDY, JOINTS = FOLDER / "study.json", FOLDER / "joints.json"
PAGE, FIGURES = FOLDER / "README.md", FOLDER / "figures"

_WRITTEN: Any = read_yaml(FOLDER / "rivals.yaml")
RIVALS = tuple(Rival(**entry | {"solve": resolve_name(entry["solve"])}) for entry in _WRITTEN)
"""The rivals, in the order of the table."""

_INTRODUCTION = """# Side by side

Written by `make rivals`, on one thread. Each row is one rival on one problem, at its best: its own search for
hyperparameters where it has one, otherwise the likeliest ones. **Largest violation** is a fact, found by the library's
enclosures and exact checks of polynomials: no grid is involved. It is a part of the bound's width, at any time of
the window, between the times that a rival looked at too. **J** is −2 ln p of function and samples together, which
this project minimises (smaller is better; only for sums of kernels). **Misfit**, **held out** and **error** (to the
truth) are root mean squares, as parts of the spread of the samples. The error is over the whole window, also after the
last sample. **Time** is processor time, without the judge's. What is *proved* of others is proved here, of the curve
that they handed out, on the window; a violation of 1e-10 % is a solver's tolerance.
A rival that fails is a row that says so.

The drive cycle is a part of the Urban Dynamometer Driving Schedule ([in the public domain](data/README.md)).
"""


_ABOUT_PENDULUM = f"""## A pendulum that others chose

x″ = −10 x + w, w′ = u on [0, 1], x(0) = 0.5, x′(0) = 0, w(0) = 0, x(1/3) = 0.5, x(1) = 0, x′ ≥ −3, |w| ≤ 10; minimise
−100 x′(1) + 10⁻⁴ ∫ u². Printed numbers are those of {pendulum.PAPER}, cut after two digits. A grid leaves a spike of w
between its points. Second-order cones keep the bounds for all t, and pay for that. A spline for the flat output x, with
bounds of its Bernstein coefficients, is proved to keep them for all t too, and pays next to nothing.
"""


_ABOUT_JOINTS = f"""## Motions of seven joints

Fast motions within limits of velocity ({joints.VELOCITY:g} rad/s), acceleration ({joints.ACCELERATION:g} rad/s²) and,
for Ruckig, jerk ({joints.JERK:g} rad/s³), {joints.PROBLEMS} of each planner: through six random waypoints, or from rest
to rest. Limits are wider by {joints.ROUNDING:g} of their widths, for rounding. **Kept** is proved between the points;
**by** is the most of what joints break first, as a part of its limit; the least **slowdown** with which all motions
keep all limits is proved too. TOPP-RA has its default grid; a finer one breaks less.
"""


_ABOUT_FIGURES = """## Between the times of a grid

![Violations against time](figures/violations.svg)

The axis of the guide. A finer grid breaks less and costs more; it never says that nothing is broken. The others keep
the bounds at all times of the window.

![Error against tightness](figures/tightness.svg)
"""


_ABOUT_STUDY = """## Many draws

`make study` draws 10,000 problems and gives each rival the same: three systems, three levels of noise, five
tightnesses of one bound, three densities of samples, a SeedSequence child for each run. What is done is kept in
`.study`, a line for each run, and not done again when the study was stopped; begin with an empty folder when the code
has changed. Two processes, or a Dask cluster (`python -m benchmarks.rivals.study --folder FOLDER --cluster ADDRESS`),
write the same bytes as one. `study.json` has two summaries, of one run of each combination and of all.
`python -m benchmarks.rivals.study --folder FOLDER --runs 135 --check benchmarks/rivals/study.json` compares the first
in some minutes, and ends with 1 where it is not reproduced; without `--runs` it compares both.

The tables below were written by earlier code, in which ours started from what the other rivals of a run had found.
Their numbers are not reproduced to the last digit.

The bound is **slack**; the truth **touches** it; it is **active**, and cuts off noise and a little of the truth; the
**truth** is clearly **outside**; or bounds are **infeasible**, for all trajectories. It is the upper bound of the state
in Example 1, of the input in Example 2, and of the velocity in the system with two states (a vehicle's axis).

What all rivals of a run share: the standard deviation of the noise and the period are known, other hyperparameters are
the likeliest ones (from four starts, sought once a run). Grids have 100 times, and so have the cones; hat functions
have a knot at every sampling instant; the governor has its best of 12 settings. Ours are those of the table above.

**Infeasible**: the rival says so. **Failed**: it has no curve for another reason, or no proof. **Collapsed**: off the
samples by more than three times what the unconstrained mean is, by more than the noise and by more than a tenth of
their spread. **Violated**: certainly, by more than 1e-9 of the bound's width, at the times that float64 finds worst;
**worst** is the largest. The error to the truth is a part of the samples' spread, from time zero to the last sample;
its median has a band of 95 % confidence, from order statistics. Where the truth is outside, an error remains whatever
one does; the unconstrained mean has less of it, and breaks the bound.

![Errors, violations and collapses against tightness](figures/study.svg)
"""


def write() -> None:
    """Write the page and its figures from what was measured."""
    rows, drawn = read(table.Row, RESULTS), study.read(STUDY)[-1]
    save(violations(read(table.Row, SWEEP)), FIGURES / "violations.svg")
    save(tightness(rows), FIGURES / "tightness.svg")
    save(errors(drawn), FIGURES / "study.svg")
    promises = markdown(("", "rival", "of bounds", "source", "licence"), "lllll", map(_promise, RIVALS))
    lines = [_INTRODUCTION, "## What they promise", "", promises, ""]
    lines += [_ABOUT_PENDULUM, pendulum.page(read(pendulum.Row, PENDULUM)), ""]
    lines += [_ABOUT_JOINTS, joints.page(read(joints.Row, JOINTS)), ""]
    lines += [_ABOUT_FIGURES, "## What they did", "", table.page(rows), _ABOUT_STUDY, study.page(drawn)]
    PAGE.write_text("\n".join(lines), encoding="utf-8")


def _promise(rival: Rival) -> list[str]:
    said = "; ".join(part for part in (rival.summary, rival.quote and f"“{rival.quote}”") if part)
    return [rival.letter, rival.name, said, rival.source, rival.licence]
