"""Answer recordings by several processes of this machine, or by the workers of a Dask cluster."""

import os
import signal
import time
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from threading import Thread
from typing import Any
from warnings import catch_warnings, simplefilter

from trackably.errors import InputError
from trackably.fleet.answer import Answer, answer
from trackably.fleet.request import Request
from trackably.fleet.row import Row
from trackably.fleet.sources import Source

_LOOKED_EVERY = 0.5  # seconds, for the parent of a worker


def answers(
    asked: Iterable[tuple[Source, Row | None]], request: Request, workers: int, cluster: str | None
) -> Generator[Answer, None, None]:
    """Yield answers as they are ready, in any order. InputError: the cluster's packages are not installed.

    What is not answered when the iterator is closed is given up. An answer never depends on who finds it.
    """
    if cluster is None and workers == 1:
        yield from (answer(source, request, kept) for source, kept in asked)
        return
    from joblib import Parallel, delayed  # noqa: PLC0415  not needed to load the library

    here: dict[str, Any] = {"backend": "loky", "initializer": _begin_worker, "initargs": (os.getpid(),)}
    with _on(cluster):
        pool = Parallel(
            n_jobs=-1 if cluster else workers,
            return_as="generator_unordered",
            batch_size=1,
            **({} if cluster else here),
        )
        found = pool(delayed(answer)(source, request, kept) for source, kept in asked)
        try:
            for each in found:  # noqa: UP028  `yield from` would close `found` before the next lines
                yield each
        finally:
            with catch_warnings():
                simplefilter("ignore")  # joblib warns of what is given up
                found.close()


def _begin_worker(parent: int) -> None:
    """Leave interrupts to the parent, which ends its workers, and end this process where the parent was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOKED_EVERY)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@contextmanager
def _on(cluster: str | None) -> Iterator[None]:
    """Send what joblib runs in this context to a Dask cluster, if there is one."""
    if cluster is None:
        yield
        return
    try:
        from distributed import Client  # noqa: PLC0415  an optional package
    except ImportError:
        raise InputError("cluster: needs Dask, which pip install 'trackably[cluster]' installs") from None
    from joblib import parallel_config  # noqa: PLC0415  not needed to load the library

    client = Client(cluster)  # type: ignore[no-untyped-call]
    with client, parallel_config(backend="dask"):
        yield
