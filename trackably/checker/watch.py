"""Watch a check: the time and the memory that it may take, how long its numbers may be, and how far it is."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from fractions import Fraction
from time import monotonic

from trackably.checker.limits import BITS, BITS_TOGETHER, MEMORY

if sys.platform != "win32":
    from resource import RUSAGE_SELF, getrusage

Report = Callable[[int, int], object]
"""Told how many boxes or instants are checked, and of how many."""

_EVERY = 0.05
"""Seconds between two looks at the memory."""


class UndecidedError(Exception):
    """The check is given up at a limit, which the message names."""


@dataclass
class _Watch:
    seconds: float
    ends: float
    memory: float
    report: Report
    look: float
    """When to look at the clock and the memory again."""


def _silent(done: int, of: int) -> None:
    pass


_NEVER = float("inf")
_UNWATCHED = _Watch(_NEVER, _NEVER, _NEVER, _silent, _NEVER)
_WATCH = ContextVar("watch", default=_UNWATCHED)


@contextmanager
def watched(seconds: float | None, report: Report | None) -> Iterator[None]:
    """Limit the time and the memory of what runs inside, and report its progress.

    Raise UndecidedError where a limit is exceeded.
    """
    now, seconds = monotonic(), _NEVER if seconds is None else seconds
    before = _WATCH.set(_Watch(seconds, now + seconds, _peak() + MEMORY, report or _silent, now))
    try:
        yield
    finally:
        _WATCH.reset(before)


def tick() -> None:
    """Raise UndecidedError if time or memory are over. Sums call this: nothing that takes long gets by without them."""
    watch = _WATCH.get()
    if (now := monotonic()) < watch.look:
        return
    if now > watch.ends:
        raise UndecidedError(f"not decided within {watch.seconds:g} s")
    if _peak() > watch.memory:
        raise UndecidedError(f"not decided within {MEMORY // 10**6} MB of memory")
    watch.look = min(watch.ends, now + _EVERY)


def progress(done: int, of: int) -> None:
    """Report how far the check is."""
    tick()
    _WATCH.get().report(done, of)


def short(number: Fraction) -> Fraction:
    """Return a rational number. Raise UndecidedError where it is so long that no next operation would end soon."""
    tick()
    if max(number.numerator.bit_length(), number.denominator.bit_length()) > BITS:
        raise UndecidedError(f"not decided with rational numbers of {BITS} bits")
    return number


def require_room(count: int, bits: int) -> None:
    """Raise UndecidedError where so many whole numbers of so many bits are too long together."""
    if count * bits > BITS_TOGETHER:
        raise UndecidedError(f"not decided with whole numbers of {BITS_TOGETHER} bits together")


def _peak() -> float:
    """Return how much memory the process has held at most [bytes]; 0 where the system does not say."""
    if sys.platform == "win32":
        return 0.0
    return getrusage(RUSAGE_SELF).ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0)


_PATIENCE, _BETWEEN = 3.0, 0.25
"""Seconds before the first line, and between two."""


class ProgressLine:
    """One line of stderr, written over and over; nothing where stderr is no terminal."""

    def __init__(self) -> None:
        self._next = monotonic() + _PATIENCE
        self._width = 0

    def __call__(self, done: int, of: int) -> None:
        """Say how many boxes or instants are checked, unless that was said a moment ago."""
        if monotonic() >= self._next and sys.stderr.isatty():
            self._next = monotonic() + _BETWEEN
            self._write(f"checked {done} of {of}")

    def clear(self) -> None:
        """Leave an empty line."""
        if self._width:
            self._write("")
            self._write_raw("\r")

    def _write(self, line: str) -> None:
        self._write_raw(f"\r{line.ljust(self._width)}")
        self._width = len(line)

    def _write_raw(self, text: str) -> None:
        sys.stderr.write(text)
        sys.stderr.flush()
