"""Time two ways to do the same in turns, so that disturbances affect both equally, and describe the machine."""

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
from timeit import timeit
from typing import TypeVar

import numpy as np

from pipeline.environment import environment

T = TypeVar("T")
ROOT = Path(__file__).resolve().parent.parent
_PARTNERS = ("scikit-learn", "casadi", "do-mpc")
_BURST = 0.05  # seconds of a burst: shorter calls are repeated until they take as long together
_MOST_CALLS = 200


class Disagreement(AssertionError):
    """Two ways to solve the same problem give different answers, so that comparing their times means nothing."""


FAILURES = (AssertionError, ArithmeticError, LookupError, OSError, RuntimeError, TypeError, ValueError)
"""Exceptions of a comparison that become a row with the reason; rows that were measured before are kept."""


@dataclass(frozen=True)
class Row:
    """One comparison: seconds of both ways, their ratio with its range over the rounds, and the target of the ratio.

    `ratio` says how many times longer the `rival` takes; with `at_most`, how many times longer ours takes. It is NaN
    without a rival, or if the rival failed or gave another answer; `failure` is then a sentence about the reason.
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

    @property
    def verdict(self) -> str:
        """A word: whether the target is met or missed, or the comparison failed; empty without a target."""
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
    """Return a row with the ratio of our number (an error, or a time) to another one."""
    ratio, times = own / other, (own, other) if in_seconds else (nan, nan)
    return Row(topic, problem, rival, *times, ratio, ratio, ratio, target, at_most=True, note=note)


def attempted(topic: str, problem: str, rival: str, rows: Callable[[], Iterable[Row]]) -> Iterator[Row]:
    """Yield rows as they are measured; if a measurement fails, yield a row without numbers, with the reason."""
    try:
        yield from rows()
    except FAILURES as why:
        yield Row(topic, problem, rival, failure=" ".join(f"{type(why).__name__}: {why}".split()))


def within(
    topic: str, problem: str, taken: float | list[float], budget: float, note: str = "", target: float | None = 1.0
) -> Row:
    """Return a row with the part of a budget [s] that was `taken` [s]: one time, or the median of several."""
    rival = f"{budget:g} s" if budget >= 0.1 else f"{1e3 * budget:g} ms"
    row = part_of(topic, problem, rival, float(np.median(taken)), budget, target, note, in_seconds=True)
    return replace(row, lowest=float(np.min(taken)) / budget, highest=float(np.max(taken)) / budget)


def timed(run: Callable[[], T]) -> tuple[T, float]:
    """Return the result of a function, and the processor time [s] that it takes."""
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
    """Time `ours` and `theirs` in short bursts, in turns; return a row with medians of processor time on one thread.

    Before that, `check` is called, which raises Disagreement if both give different answers. If it does, or if one of
    both fails, the row has the reason. A `note` that is a function is called at the end.

    Processor time is the time that a clock shows on a machine without other work.
    """

    def row() -> Iterator[Row]:
        check()
        both = [(way, _calls(way)) for way in (ours, theirs)]
        times = [[burst(*each) for each in both] for _ in range(rounds)]
        own, other = (median(column) for column in zip(*times, strict=True))
        ratios = [a / b if at_most else b / a for a, b in times]
        numbers = own, other, median(ratios), min(ratios), max(ratios)
        yield Row(topic, problem, rival, *numbers, target, at_most, note if isinstance(note, str) else note())

    return next(attempted(topic, problem, rival, row))


def agree(what: str, ours: float, theirs: float, tolerance: float) -> None:
    """Raise Disagreement if two objective values differ by more than `tolerance`, relative to 1 + |value|."""
    if not abs(ours - theirs) <= tolerance * (1 + abs(ours)):
        raise Disagreement(f"{what}: {ours!r} and {theirs!r} differ by more than {tolerance:g}")


def no_worse(what: str, ours: float, theirs: float, tolerance: float) -> None:
    """Raise Disagreement if our objective value is larger than theirs, or theirs is not finite.

    A difference of `tolerance`, relative to 1 + |value|, is allowed.
    """
    if not ours <= theirs + tolerance * (1 + abs(ours)) < float("inf"):
        raise Disagreement(f"{what}: {ours!r} is worse than {theirs!r}, by more than {tolerance:g}")


def kept(found: object, wanted: type[T]) -> T:
    """Return `found` if it has the type `wanted`; otherwise raise an error, which ends the comparison."""
    assert isinstance(found, wanted), getattr(found, "explanation", found)
    return found


def grouped(count: int) -> str:
    """Return a number with a space after each group of three digits."""
    return f"{count:,}".replace(",", " ")


def in_new_process(*arguments: str, environment: dict[str, str] | None = None) -> str:
    """Run `python` with the arguments in the project's folder, and return its output."""
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True, env=environment).stdout


def _calls(question: Callable[[], object]) -> int:
    """Return how many calls fill a burst; the first call, which loads and compiles, is not counted."""
    if (taken := burst(question, 1)) < _BURST:
        taken = burst(question, 3)
    return int(np.clip(_BURST / max(taken, 1e-9), 1, _MOST_CALLS))


def burst(question: Callable[[], object], calls: int) -> float:
    """Return the mean processor time [s] of a number of `calls`."""
    return timeit(question, timer=process_time, number=calls) / calls


def described(load_before: float) -> dict[str, str]:
    """Return a description of the machine by name: processor, versions, and its load at the start and now.

    The load is the mean number of processes that could run in the last minute.
    """
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": names[0] if names else platform.machine(),
        "cores": str(os.cpu_count()),
        "load": f"{load_before:.1f} at the start, {os.getloadavg()[0]:.1f} at the end (one minute, all work included)",
        **environment(),
        **{found.name: found.version for found in distributions() if found.name.replace("_", "-") in _PARTNERS},
    }
