"""Freed memory: the C library gives it back to the system, and asks for it again for the next array."""

from functools import cache

import numpy as np

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
