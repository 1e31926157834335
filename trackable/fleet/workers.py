"""Answer recordings by several processes of this machine, or by the workers of a Dask cluster."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from trackable.errors import InputError
from trackable.fleet.answer import Answer, answer
from trackable.fleet.request import Request
from trackable.fleet.row import Row
from trackable.fleet.sources import Source


def answers(
    asked: Iterable[tuple[Source, Row | None]], request: Request, workers: int, cluster: str | None
) -> Iterator[Answer]:
    """Yield answers as they are ready, in any order. InputError: the cluster's packages are not installed.

    What is not answered when the iterator is closed is given up. An answer never depends on who finds it.
    """
    if cluster is None and workers == 1:
        yield from (answer(source, request, kept) for source, kept in asked)
        return
    from joblib import Parallel, delayed  # noqa: PLC0415  not needed to load the library

    with _on(cluster):
        pool = Parallel(n_jobs=-1 if cluster else workers, return_as="generator_unordered", batch_size=1)
        yield from pool(delayed(answer)(source, request, kept) for source, kept in asked)


@contextmanager
def _on(cluster: str | None) -> Iterator[None]:
    """Send what joblib runs in this context to a Dask cluster, if there is one."""
    if cluster is None:
        yield
        return
    try:
        from distributed import Client  # noqa: PLC0415  an optional package
    except ImportError:
        raise InputError("cluster: needs Dask, which pip install 'trackable[cluster]' installs") from None
    from joblib import parallel_config  # noqa: PLC0415  not needed to load the library

    client = Client(cluster)  # type: ignore[no-untyped-call]
    with client, parallel_config(backend="dask"):
        yield
