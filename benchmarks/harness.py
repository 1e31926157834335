"""Two ways to do the same thing, timed in turns: what disturbs one of them disturbs the other; and on what machine."""

import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from importlib.metadata import distributions
from math import nan
from pathlib import Path
from statistics import median
from time import process_time
from typing import TypeVar

import numpy as np

from pipeline.environment import environment
from trackably.arrays import Array

T = TypeVar("T")
ROOT = Path(__file__).resolve().parent.parent
_PARTNERS = ("scikit-learn", "casadi", "do-mpc")
_BURST = 0.05  # seconds: shorter calls are repeated until it takes as long
_MOST_CALLS = 200


class Disagreement(AssertionError):
    """Two ways to solve the same problem do not end at the same answer: their times are not worth comparing."""


FAILURES = (AssertionError, ArithmeticError, LookupError, OSError, RuntimeError, TypeError, ValueError)
"""What others may raise where they fail: it becomes a row, and what was measured before it stays."""


@dataclass(frozen=True)
class Row:
    """One comparison: seconds of both, the ratio with its range over the rounds, and what was wanted of it.

    `ratio` says how many times longer the `rival` takes; with `at_most` it is the other way round. NaN: no rival, or
    one that failed or came to another answer, of which `failure` is the sentence.
    """

    topic: str
    problem: str
    rival: str
    seconds: float = nan
    rival_seconds: float = nan
    ratio: float = nan
    lowest: float = nan
    highest: float = nan
    target: float | None = None
    at_most: bool = False
    note: str = ""
    failure: str = ""

    @classmethod
    def failed(cls, topic: str, problem: str, rival: str, why: BaseException) -> "Row":
        """Return a row without numbers."""
        return cls(topic, problem, rival, failure=" ".join(f"{type(why).__name__}: {why}".split()))

    @property
    def verdict(self) -> str:
        """Whether the target is met, or the comparison failed; empty where there is no target."""
        if self.failure:
            return "failed"
        if self.target is None:
            return ""
        return "met" if (self.ratio <= self.target if self.at_most else self.ratio >= self.target) else "missed"


def part_of(
    topic: str,
    problem: str,
    rival: str,
    own: float,
    other: float,
    target: float | None = None,
    note: str = "",
    in_seconds: bool = False,
) -> Row:
    """Return the row that says which part of another number ours is: of errors, or of times."""
    ratio, times = own / other, (own, other) if in_seconds else (nan, nan)
    return Row(topic, problem, rival, *times, ratio, ratio, ratio, target, at_most=True, note=note)


def attempted(topic: str, problem: str, rival: str, rows: Callable[[], Iterable[Row]]) -> Iterator[Row]:
    """Yield rows as they are measured; where one cannot be, a row says why."""
    try:
        yield from rows()
    except FAILURES as why:
        yield Row.failed(topic, problem, rival, why)


def within(
    topic: str, problem: str, taken: float | list[float], budget: float, note: str = "", target: float | None = 1.0
) -> Row:
    """Return the row that says which part of a budget [s] was taken, in the median where it was taken several times."""
    times = np.atleast_1d(taken)
    rival = f"{budget:g} s" if budget >= 0.1 else f"{1e3 * budget:g} ms"
    parts = [float(part) / budget for part in (np.median(times), times.min(), times.max())]
    return Row(topic, problem, rival, parts[0] * budget, budget, *parts, target, at_most=True, note=note)


def timed(run: Callable[[], T]) -> tuple[T, float]:
    """Return what a function returns, and the seconds of processor time that it takes."""
    before = process_time()
    return run(), process_time() - before


def duel(
    topic: str,
    problem: str,
    rival: str,
    ours: Callable[[], object],
    theirs: Callable[[], object],
    *,
    rounds: int = 9,
    target: float | None = None,
    at_most: bool = False,
    note: str | Callable[[], str] = "",
    check: Callable[[], object] = lambda: None,
) -> Row:
    """Short bursts of one and the other, in turns; medians of processor time on one thread.

    Before that, `check` raises Disagreement where they come to different answers. That, and whatever makes one of them
    fail, is the row. A `note` that is a function is asked when all is measured.

    Processor time is what a clock shows on a machine with nothing else to do.
    """
    try:
        check()
        calls = [_calls(ours), _calls(theirs)]
        times = [(burst(ours, calls[0]), burst(theirs, calls[1])) for _ in range(rounds)]
        said = note if isinstance(note, str) else note()
    except FAILURES as why:
        return Row.failed(topic, problem, rival, why)
    ratios = [a / b if at_most else b / a for a, b in times]
    own, other = (median(column) for column in zip(*times, strict=True))
    row = Row(topic, problem, rival, own, other, median(ratios), min(ratios), max(ratios), note=said)
    return replace(row, target=target, at_most=at_most)


def agree(what: str, ours: float, theirs: float, tolerance: float) -> None:
    """Raises Disagreement if two objective values are not the same, relative to 1 + |value|."""
    if not abs(ours - theirs) <= tolerance * (1 + abs(ours)):
        raise Disagreement(f"{what}: {ours!r} and {theirs!r} differ by more than {tolerance:g}")


def no_worse(what: str, ours: float, theirs: float, tolerance: float) -> None:
    """Raises Disagreement if our objective value is the larger one, or theirs is none."""
    if not ours <= theirs + tolerance * (1 + abs(ours)) < float("inf"):
        raise Disagreement(f"{what}: {ours!r} is worse than {theirs!r}, by more than {tolerance:g}")


def kept(found: object, wanted: type[T]) -> T:
    """Return what was found; a comparison that finds something else is stopped, and says it."""
    assert isinstance(found, wanted), getattr(found, "explanation", found)
    return found


def grouped(count: int) -> str:
    """Return a number with a space after each group of three digits."""
    return f"{count:,}".replace(",", " ")


def root_mean_square(values: Array) -> float:
    """Return √(mean of squares)."""
    return float(np.sqrt(np.mean(values**2)))


def in_new_process(*arguments: str, environment: dict[str, str] | None = None) -> str:
    """Return what `python …` prints, run in the project's folder."""
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True, env=environment).stdout


def _calls(question: Callable[[], object]) -> int:
    """How many of them fill a burst; the first call, which loads and compiles, does not count."""
    taken = burst(question, 1)
    if taken < _BURST:
        taken = burst(question, 3)
    return max(1, min(_MOST_CALLS, int(_BURST / max(taken, 1e-9))))


def burst(question: Callable[[], object], calls: int) -> float:
    """Return the processor time [s] of a call, the mean of some."""
    before = process_time()
    for _ in range(calls):
        question()
    return (process_time() - before) / calls


def load() -> float:
    """How many others wanted the processor, in the last minute."""
    return os.getloadavg()[0]


def described(load_before: float) -> dict[str, str]:
    """The processor and what ran on it; one line each."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": names[0] if names else platform.machine(),
        "cores": str(os.cpu_count()),
        "load": f"{load_before:.1f} at the start, {load():.1f} at the end (one minute, others' work included)",
        **environment(),
        **{found.name: found.version for found in distributions() if found.name.replace("_", "-") in _PARTNERS},
    }
