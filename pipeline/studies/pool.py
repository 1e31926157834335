"""Processes for the studies, which end when a user interrupts the stage."""

import multiprocessing
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

Row = TypeVar("Row")
Task = tuple[Callable[..., Row], Iterable[Iterable[object]]]


@contextmanager
def mapped(*tasks: Task[Row]) -> Iterator[list[Iterator[Row]]]:
    """Give the results of each function for its iterables of arguments, as `map` does, computed on all cores.

    A terminal interrupts all processes of a command. These ignore it, from their first line on, so that none of them
    prints where it was; the first process ends them.
    """
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        try:
            with _ignored_interrupts():
                results = [pool.map(function, *arguments) for function, arguments in tasks]
            yield results
        except KeyboardInterrupt:
            for process in multiprocessing.active_children():
                process.terminate()
            raise


@contextmanager
def _ignored_interrupts() -> Iterator[None]:
    """Ignore interrupts for a moment, and in the processes that begin in it for good."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
