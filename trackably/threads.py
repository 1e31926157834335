"""Threads of the linear algebra libraries, and the memory that their arrays leave."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np

# Freed memory: the C library gives it back to the system, and asks for it again for the next array.

_LARGEST = 31 << 20  # bytes: of allocations above 32 MiB glibc learns nothing


@cache
def keep_freed_memory() -> None:
    """Let the process keep up to 62 MiB that it has freed, once and for all.

    Arrays of a few hundred KiB come and go by the thousand here. With its first limit of 128 KiB, glibc gives such
    memory back each time, and the system clears every page of it again: a fifth of the time of a small window. glibc
    raises its limits when a large allocation is freed, to its size and twice as much. This one is never written to,
    so that no memory is taken for it; other C libraries pass over it.
    """
    np.empty(_LARGEST, dtype=np.uint8)


# Threads of the linear algebra libraries: one is faster for small matrices, many times so on a busy machine.


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
