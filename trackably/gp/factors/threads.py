"""Threads of the linear algebra libraries: one is faster for small matrices, many times so on a busy machine."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from trackably.gp.factors.memory import keep_freed_memory


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let NumPy's and SciPy's BLAS use one thread inside, and as many as before afterwards; also a decorator.

    Results are then the same on machines with other numbers of cores. The limit is that of the whole process. What asks
    for it computes with many small arrays: from then on the process also keeps the memory that they leave.
    """
    keep_freed_memory()
    with _libraries().limit(limits=1, user_api="blas"):
        yield


@cache
def _libraries() -> Any:
    """Return all libraries that are loaded, which takes 10 ms: NumPy and SciPy have loaded theirs before."""
    import scipy.linalg  # noqa: F401, PLC0415
    from threadpoolctl import ThreadpoolController  # noqa: PLC0415  loaded by what learns only

    return ThreadpoolController()
