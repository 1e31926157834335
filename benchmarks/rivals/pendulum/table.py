"""The pendulum's table: printed numbers, and ours beside them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from time import process_time

from benchmarks.rivals.adapters.conic import Unsolved
from benchmarks.rivals.pendulum import proved, transcribed
from benchmarks.rivals.pendulum.proved import Spline
from benchmarks.rivals.pendulum.transcribed import Trajectory
from benchmarks.rivals.tables import markdown

PAPER = "Aubin-Frankowski, SICON 2021, figure 1"


@dataclass(frozen=True)
class Row:
    """x′(1), and by how much a bound is broken between the grid's points: at least and at most.

    `printed` is x′(1) in the paper, cut after two digits; None where it prints nothing.
    """

    way: str
    final_speed: float | None = None
    least: float | None = None
    most: float | None = None
    largest_w: float | None = None
    seconds: float | None = None
    printed: float | None = None
    says: str = ""


_WAYS: tuple[tuple[str, Callable[[], Trajectory | Spline | Unsolved], float | None], ...] = (
    ("bounds on 200 points", partial(transcribed.solve, 200, cones=False), 3.21),
    ("second-order cones around 200 points", partial(transcribed.solve, 200, cones=True), 1.49),
    ("second-order cones around 400 points", partial(transcribed.solve, 400, cones=True), 1.81),
    ("second-order cones around 800 points", partial(transcribed.solve, 800, cones=True), 2.07),
    ("flat output, spline of 60 intervals, exact", partial(proved.solve, 60), None),
    ("flat output, spline of 240 intervals, exact", partial(proved.solve, 240), None),
)


def rows() -> Iterator[Row]:
    """Yield the rows as they are measured."""
    for way, solve, printed in _WAYS:
        started = process_time()
        found = solve()
        seconds = process_time() - started
        if isinstance(found, Unsolved):
            yield Row(way, seconds=seconds, printed=printed, says=f"CLARABEL says {found.status}")
            continue
        facts = found.facts()
        least, most = facts.violation
        yield Row(way, facts.final_speed, least, most, facts.w[1], seconds, printed)


def page(found: Sequence[Row]) -> str:
    """Return the table as Markdown."""
    head = ("", "x′(1)", "printed", "largest \\|w\\| for all t", "largest violation", "time")
    return markdown(head, "lrrrrr", map(_cells, found))


def _cells(row: Row) -> list[str]:
    printed, time = "" if row.printed is None else f"{row.printed:.2f}", f"{row.seconds:.2g} s"
    if row.final_speed is None or row.least is None:
        return [row.way, row.says, printed, "", "", time]
    broken = "**none: proved**" if row.most == 0 else f"{row.least:.3g}"
    return [row.way, f"{row.final_speed:.4f}", printed, f"{row.largest_w:.4f}", broken, time]
