"""The page: what each rival promises, and what it did."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.rivals import figures, joints, table
from benchmarks.rivals.adapters import (
    drake,
    fine_grid,
    flatsys,
    governor,
    gp_sklearn,
    ours,
    splines,
    tightened,
    toppra_path,
    truncated,
)
from benchmarks.rivals.model import Rival
from benchmarks.rivals.pendulum import table as pendulum
from benchmarks.rivals.study import summary as study
from benchmarks.rivals.tables import markdown, read
from pipeline.drawings.style import save

RIVALS: tuple[Rival, ...] = (
    gp_sklearn.SKLEARN,
    fine_grid.FINE_GRID,
    tightened.TIGHTENED,
    truncated.MODE,
    truncated.MEAN,
    drake.DRAKE,
    toppra_path.TOPP_RA,
    flatsys.FLATSYS,
    splines.SPLINE,
    governor.GOVERNOR,
    ours.ALGORITHM_1,
    ours.HYPERPARAMETERS,
    ours.JOINT,
)
"""The rivals, in the order of the table."""

FOLDER = Path(__file__).parent
RESULTS, PENDULUM, SWEEP = FOLDER / "results.json", FOLDER / "pendulum.json", FOLDER / "sweep.json"
STUDY, JOINTS = FOLDER / "study.json", FOLDER / "joints.json"
PAGE, FIGURES = FOLDER / "README.md", FOLDER / "figures"

_INTRODUCTION = """# Side by side

Written by `make rivals`, on one thread. Each row is one rival on one problem, at its best: its own search for
hyperparameters where it has one, otherwise the likeliest ones. **Largest violation** is a fact, found by the library's
enclosures or by exact extremes of polynomials: no grid is involved. It is a part of the bound's width, at any time of
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
bounds of its Bernstein coefficients in exact rationals, keeps them for all t too, and pays next to nothing.
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
tightnesses of one bound, three densities of samples, a SeedSequence child for each run. What is done is
kept in `.study`, one file for twenty runs, and not done again when the study was stopped; begin with an empty folder
when the code has changed. Two processes, or a Dask cluster (`python -m benchmarks.rivals.study --folder FOLDER
--cluster ADDRESS`), write the same bytes as one. `study.json` has two summaries, of one run of each combination and of
all. `python -m benchmarks.rivals.study --folder FOLDER --runs 135 --check benchmarks/rivals/study.json` compares the
first in a minute or two, and ends with 1 where it is not reproduced; without `--runs` it compares both.

The tables below were written by earlier code, and are not reproduced to the last digit. In the check of 135 runs, 16
numbers differ: an end of a band of ours by 0.4 %, all others from the fourth digit on. No count differs.

The bound is **slack**; the truth **touches** it; it is **active**, and cuts off noise and a little of the truth; the
**truth** is clearly **outside**; or bounds are **infeasible**, for all trajectories. It is the upper bound of the state
in Example 1, of the input in Example 2, and of the velocity in the system with two states (a vehicle's axis).

What all rivals of a run share: the standard deviation of the noise and the period are known, other hyperparameters are
the likeliest ones (from four starts, sought once a run). Grids have 100 times, and so have the cones; hat functions
have a knot at every sampling instant; the governor has its best of 12 settings. Ours are proved on the window on which
all are judged, and the joint search starts from the minimum over θ alone, which is a rival too. In Example 2, θ alone
starts from the likelihood's minima.

**Infeasible**: the rival says so. **Failed**: it has no curve for another reason, or no proof. **Collapsed**: off the
samples by more than three times what the unconstrained mean is, by more than the noise and by more than a tenth of
their spread. **Violated**: certainly, by more than 1e-9 of the bound's width, at the times that float64 finds worst;
**worst** is the largest. The error to the truth is a part of the samples' spread, from time zero to the last sample;
its median has a band of 95 % confidence, from order statistics. Where the truth is outside, an error remains whatever
one does; the unconstrained mean has less of it, and breaks the bound.

![Errors, violations and collapses against tightness](figures/study.svg)
"""


def write(rows: Sequence[table.Row], swings: Sequence[pendulum.Row], finer: Sequence[table.Row]) -> None:
    """Write the page and its figures."""
    FIGURES.mkdir(exist_ok=True)
    save(figures.violations(finer), FIGURES / "violations.svg")
    save(figures.tightness(rows), FIGURES / "tightness.svg")
    promises = markdown(("", "rival", "of bounds", "source", "licence"), "lllll", map(_promise, RIVALS))
    moved = ["", _ABOUT_JOINTS, joints.page(read(joints.Row, JOINTS))] if JOINTS.exists() else []
    lines = [_INTRODUCTION, "## What they promise", "", promises, "", _ABOUT_PENDULUM, pendulum.page(swings), *moved]
    lines += ["", _ABOUT_FIGURES, "## What they did", "", table.page(rows)]
    if STUDY.exists():
        drawn = study.read(STUDY)[-1]
        save(figures.study(drawn), FIGURES / "study.svg")
        lines += [_ABOUT_STUDY, study.page(drawn)]
    PAGE.write_text("\n".join(lines), encoding="utf-8")


def _promise(rival: Rival) -> list[str]:
    of = rival.promise
    said = "; ".join(part for part in (of.summary, f"“{of.quote}”" if of.quote else "") if part)
    return [rival.letter, rival.name, said, of.source, rival.licence]
