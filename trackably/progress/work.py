"""What is under way: loops tell each piece of work that they have done, to whoever watches. A budget may end it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from math import inf
from time import monotonic
from typing import Literal

Work = Literal["fit", "evaluation", "box"]
"""A fit with its attempted proof, an evaluation of objective, function or margins, or a box of time that is proved."""

_WATCHER: ContextVar[Callable[[Work], object] | None] = ContextVar("watcher", default=None)
_END: ContextVar[float] = ContextVar("end", default=inf)


class BudgetEnded(Exception):
    """The time that was given for some work is over."""


@contextmanager
def until(end: float) -> Iterator[None]:
    """Raise BudgetEnded from the first piece of work in this context that is done at `end` or later, by `monotonic`."""
    before = _END.set(min(end, _END.get()))
    try:
        yield
    finally:
        _END.reset(before)


@contextmanager
def watched(by: Callable[[Work], object]) -> Iterator[None]:
    """Call `by` after each piece of work that is done in this context; nobody is called elsewhere."""
    before = _WATCHER.set(by)
    try:
        yield
    finally:
        _WATCHER.reset(before)


def done(work: Work) -> None:
    """Tell that a piece of work is done. Results never depend on who watches. BudgetEnded: as `until` says."""
    if watcher := _WATCHER.get():
        watcher(work)
    if (end := _END.get()) < inf and monotonic() >= end:
        raise BudgetEnded
