"""Two ways to do the same thing, timed in turns: what disturbs one of them disturbs the other."""

from collections.abc import Callable
from dataclasses import dataclass
from math import nan
from statistics import median
from time import process_time

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
    seconds: float
    rival_seconds: float
    ratio: float
    lowest: float
    highest: float
    target: float | None = None
    at_most: bool = False
    note: str = ""
    failure: str = ""

    @classmethod
    def failed(cls, topic: str, problem: str, rival: str, why: BaseException) -> "Row":
        """Return a row without numbers."""
        sentence = " ".join(f"{type(why).__name__}: {why}".split())
        return cls(topic, problem, rival, *[nan] * 5, failure=sentence)

    @property
    def verdict(self) -> str:
        """Whether the target is met, or the comparison failed; empty where there is no target."""
        if self.failure:
            return "failed"
        if self.target is None:
            return ""
        return "met" if (self.ratio <= self.target if self.at_most else self.ratio >= self.target) else "missed"


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
    note: str = "",
    check: Callable[[], object] = lambda: None,
) -> Row:
    """Short bursts of one and the other, in turns; medians of processor time on one thread.

    Before that, `check` raises Disagreement where they come to different answers. That, and whatever makes one of them
    fail, is the row.

    Processor time is what a clock shows on a machine with nothing else to do.
    """
    try:
        check()
        calls = [_calls(ours), _calls(theirs)]
        times = [(_burst(ours, calls[0]), _burst(theirs, calls[1])) for _ in range(rounds)]
    except FAILURES as why:
        return Row.failed(topic, problem, rival, why)
    ratios = [a / b if at_most else b / a for a, b in times]
    own, other = (median(column) for column in zip(*times, strict=True))
    found = (own, other, median(ratios), min(ratios), max(ratios))
    return Row(topic, problem, rival, *found, target=target, at_most=at_most, note=note)


def agree(what: str, ours: float, theirs: float, tolerance: float) -> None:
    """Raises Disagreement where two objective values are not the same, relative to 1 + |value|."""
    if not abs(ours - theirs) <= tolerance * (1 + abs(ours)):
        raise Disagreement(f"{what}: {ours!r} and {theirs!r} differ by more than {tolerance:g}")


def no_worse(what: str, ours: float, theirs: float, tolerance: float) -> None:
    """Raises Disagreement where our objective value is the larger one, or theirs is none."""
    if not ours <= theirs + tolerance * (1 + abs(ours)) < float("inf"):
        raise Disagreement(f"{what}: {ours!r} is worse than {theirs!r}, by more than {tolerance:g}")


def _calls(question: Callable[[], object]) -> int:
    """How many of them fill a burst; the first call, which loads and compiles, does not count."""
    taken = _burst(question, 1)
    if taken < _BURST:
        taken = _burst(question, 3)
    return max(1, min(_MOST_CALLS, int(_BURST / max(taken, 1e-9))))


def _burst(question: Callable[[], object], calls: int) -> float:
    before = process_time()
    for _ in range(calls):
        question()
    return (process_time() - before) / calls
