"""The page: what each rival promises, and what it did."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.rivals import table
from benchmarks.rivals.entries import RIVALS
from benchmarks.rivals.model import Rival
from benchmarks.rivals.pendulum import table as pendulum

FOLDER = Path(__file__).parent
RESULTS, PENDULUM, PAGE = FOLDER / "results.json", FOLDER / "pendulum.json", FOLDER / "README.md"

_INTRODUCTION = """# Side by side

Written by `make rivals`, on one thread. Each row is one rival on one problem, at its best: its own search for
hyperparameters where it has one, otherwise the likeliest ones. **Largest violation** is a fact, found by the library's
enclosures or by exact extremes of polynomials: no grid is involved. It is a part of the bound's width, at any time of
the window, between the times that a rival looked at too. **J** is −2 ln p of function and samples together, which
this project minimises (smaller is better; only for sums of kernels). **Misfit**, **held out** and **error** (to the
truth) are root mean squares, as parts of the spread of the samples. **Time** is processor time, without the judge's.
A rival that fails is a row that says so.
"""


_ABOUT_PENDULUM = f"""## A pendulum that others chose

x″ = −10 x + w, w′ = u on [0, 1], x(0) = 0.5, x′(0) = 0, w(0) = 0, x(1/3) = 0.5, x(1) = 0, x′ ≥ −3, |w| ≤ 10; minimise
−100 x′(1) + 10⁻⁴ ∫ u². Printed numbers are those of {pendulum.PAPER}, cut after two digits. A grid leaves a spike of w
between its points. Second-order cones keep the bounds for all t, and pay for that. A spline for the flat output x, with
bounds of its Bernstein coefficients in exact rationals, keeps them for all t too, and pays next to nothing.
"""


def write(rows: Sequence[table.Row], swings: Sequence[pendulum.Row]) -> None:
    """Write the page."""
    lines = [_INTRODUCTION, "## What they promise", "", "| | rival | of bounds | source |", "|---|---|---|---|"]
    lines += [_promise(rival) for rival in RIVALS]
    lines += ["", _ABOUT_PENDULUM, pendulum.page(swings), "", "## What they did", "", table.page(rows)]
    PAGE.write_text("\n".join(lines), encoding="utf-8")


def _promise(rival: Rival) -> str:
    of = rival.promise
    said = "; ".join(part for part in (of.summary, f"“{of.quote}”" if of.quote else "") if part)
    return f"| {rival.letter} | {rival.name} | {said} | {of.source} |"
