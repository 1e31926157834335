"""Watch a check: the time that it may take, and how far it is."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from time import monotonic

Report = Callable[[int, int], object]
"""Told how many boxes or instants are checked, and of how many."""


class OutOfTimeError(Exception):
    """The time that a check may take is over."""


@dataclass(frozen=True)
class _Watch:
    ends: float
    report: Report


def _silent(done: int, of: int) -> None:
    pass


_UNWATCHED = _Watch(float("inf"), _silent)
_WATCH = ContextVar("watch", default=_UNWATCHED)


@contextmanager
def watched(seconds: float | None, report: Report | None) -> Iterator[None]:
    """Limit the time of what runs inside, and report its progress. Raise OutOfTimeError when it is over."""
    ends = float("inf") if seconds is None else monotonic() + seconds
    before = _WATCH.set(_Watch(ends, report or _silent))
    try:
        yield
    finally:
        _WATCH.reset(before)


def tick() -> None:
    """Raise OutOfTimeError if time is over. Sums call this: nothing that takes long gets by without them."""
    if monotonic() > _WATCH.get().ends:
        raise OutOfTimeError


def progress(done: int, of: int) -> None:
    """Report how far the check is."""
    tick()
    _WATCH.get().report(done, of)
