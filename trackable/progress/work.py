"""What is under way: loops tell each piece of work that they have done, to whoever watches."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Literal

Work = Literal["fit", "evaluation", "box"]
"""A fit with its attempted proof, an evaluation of the objective, or a box of time in which a bound is proved."""

_WATCHER: ContextVar[Callable[[Work], object] | None] = ContextVar("watcher", default=None)


@contextmanager
def watched(by: Callable[[Work], object]) -> Iterator[None]:
    """Call `by` after each piece of work that is done in this context; nobody is called elsewhere."""
    before = _WATCHER.set(by)
    try:
        yield
    finally:
        _WATCHER.reset(before)


def done(work: Work) -> None:
    """Tell that a piece of work is done. Results never depend on who watches."""
    if watcher := _WATCHER.get():
        watcher(work)
