"""Report each finished piece of work to whoever watches, and end work whose time budget is over."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from math import inf
from time import monotonic
from typing import Literal

Work = Literal["fit", "evaluation", "box", "part"]
"""A fit with its attempted proof; an evaluation of objective, function or margins; a proved box; or a part of those.

Work that may take seconds reports its parts, so that it obeys a budget, and so that its progress is shown.
"""

_WATCHER: ContextVar[Callable[[Work], object] | None] = ContextVar("watcher", default=None)
_END: ContextVar[float] = ContextVar("end", default=inf)


class BudgetEnded(Exception):
    """The time budget of some work is over."""


def seconds_left() -> float | None:
    """Return how much time is left for the work in this context [s]; None if it has no time budget."""
    return None if (end := _END.get()) == inf else max(end - monotonic(), 0.0)


@contextmanager
def until(end: float) -> Iterator[None]:
    """Within this context, raise BudgetEnded after the first piece of work that finishes at `end` or later.

    `end` [s] is a time of the clock `monotonic`.
    """
    before = _END.set(min(end, _END.get()))
    try:
        yield
    finally:
        _END.reset(before)


@contextmanager
def watch(by: Callable[[Work], object]) -> Iterator[None]:
    """Within this context, call `by` after each finished piece of work."""
    before = _WATCHER.set(by)
    try:
        yield
    finally:
        _WATCHER.reset(before)


def done(work: Work) -> None:
    """Report a finished piece of work to the function given to `watch`, if there is one; results do not depend on it.

    BudgetEnded: the time given to `until` has passed.
    """
    if watcher := _WATCHER.get():
        watcher(work)
    if (end := _END.get()) < inf and monotonic() >= end:
        raise BudgetEnded
