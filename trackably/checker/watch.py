"""Limit the time and the memory of a check and the length of its numbers, and report its progress."""

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
"""A function that is called with the number of boxes or instants checked so far, and their total number."""

_EVERY = 0.05
"""Seconds between two measurements of the memory."""


class UndecidedError(Exception):
    """The check ends at a limit of time, memory or length of numbers, which the message names."""


@dataclass
class _Watch:
    seconds: float
    ends: float
    memory: float
    report: Report
    look: float
    """The time of the next measurement of time and memory."""


def _silent(done: int, of: int) -> None:
    pass


_NEVER = float("inf")
_UNWATCHED = _Watch(_NEVER, _NEVER, _NEVER, _silent, _NEVER)
_WATCH = ContextVar("watch", default=_UNWATCHED)


@contextmanager
def watch(seconds: float | None, report: Report | None) -> Iterator[None]:
    """Limit the time and the memory of the code in this context, and report its progress.

    Raise UndecidedError if a limit is exceeded.
    """
    now, seconds = monotonic(), _NEVER if seconds is None else seconds
    before = _WATCH.set(_Watch(seconds, now + seconds, _peak() + MEMORY, report or _silent, now))
    try:
        yield
    finally:
        _WATCH.reset(before)


def tick() -> None:
    """Raise UndecidedError if time or memory is used up. All loops that may take long call this."""
    watch = _WATCH.get()
    if (now := monotonic()) < watch.look:
        return
    if now > watch.ends:
        raise UndecidedError(f"not decided within {watch.seconds:g} s")
    if _peak() > watch.memory:
        raise UndecidedError(f"not decided within {MEMORY // 10**6} MB of memory")
    watch.look = min(watch.ends, now + _EVERY)


def progress(done: int, of: int) -> None:
    """Report that `done` of `of` boxes or instants are checked."""
    tick()
    _WATCH.get().report(done, of)


def short(number: Fraction) -> Fraction:
    """Return the number unchanged. Raise UndecidedError if it is too long for further operations."""
    tick()
    if max(number.numerator.bit_length(), number.denominator.bit_length()) > BITS:
        raise UndecidedError(f"not decided: exact arithmetic would need rational numbers of more than {BITS} bits")
    return number


def require_room(count: int, bits: int) -> None:
    """Raise UndecidedError if `count` integers of `bits` bits have more than `BITS_TOGETHER` bits together."""
    if count * bits > BITS_TOGETHER:
        raise UndecidedError(
            f"not decided: exact arithmetic would need whole numbers of more than {BITS_TOGETHER} bits in total"
        )


def _peak() -> float:
    """Return the largest memory that the process has used [bytes]; 0 if the system does not tell."""
    if sys.platform == "win32":
        return 0.0
    return getrusage(RUSAGE_SELF).ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0)


_PATIENCE, _BETWEEN = 3.0, 0.25
"""Seconds from the start to the first line of progress, and between two lines."""


class ProgressLine:
    """A line on stderr that shows the progress and is rewritten in place; nothing if stderr is no terminal."""

    def __init__(self) -> None:
        self._next = monotonic() + _PATIENCE
        self._width = 0

    def __call__(self, done: int, of: int) -> None:
        """Write the number of checked boxes or instants, unless it was written a moment ago."""
        if monotonic() >= self._next and sys.stderr.isatty():
            self._next = monotonic() + _BETWEEN
            line = f"checked {done} of {of}"
            print(f"\r{line.ljust(self._width)}", end="", file=sys.stderr, flush=True)
            self._width = len(line)

    def clear(self) -> None:
        """Clear the line."""
        if self._width:
            print(f"\r{' ' * self._width}\r", end="", file=sys.stderr, flush=True)
            self._width = 0
