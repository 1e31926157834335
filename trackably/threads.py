"""Control the threads of linear algebra libraries, and keep memory that freed arrays leave."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np

# Keep freed memory, which the C library would return to the system, and request again for the next array.

_LARGEST = 31 << 20  # bytes: allocations above 32 MiB do not raise glibc's limits


@cache
def keep_freed_memory() -> None:
    """Let the process keep up to 62 MiB of freed memory from now on.

    The library allocates and frees arrays of a few hundred KiB by the thousand. With its first limit of 128 KiB, glibc
    returns such memory to the system each time, which clears every page again: a fifth of the time of a small window.
    When a large allocation is freed, glibc raises its limits to that size and to twice that size. The allocation here
    is never written to, so it takes no memory; other C libraries ignore it.
    """
    np.empty(_LARGEST, dtype=np.uint8)


# Threads of the linear algebra libraries: one is faster for small matrices, many times so on a busy machine.


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limit NumPy's and SciPy's BLAS to one thread within this context; also a decorator.

    Results are then the same on machines with other numbers of cores. The limit holds for the whole process.
    Computations in this context use many small arrays, so that the process also keeps freed memory from then on.
    """
    keep_freed_memory()
    with _libraries().limit(limits=1, user_api="blas"):
        yield


@cache
def _libraries() -> Any:
    """Return a controller of all loaded BLAS libraries, which takes 10 ms; NumPy and SciPy are loaded first."""
    import scipy.linalg  # noqa: F401, PLC0415
    from threadpoolctl import ThreadpoolController  # noqa: PLC0415  only needed to learn

    return ThreadpoolController()
