"""Functions of many times, evaluated a few at a time: memory stays bounded however many there are."""

from collections.abc import Callable

import numpy as np

from trackable.arrays import Array

_WHOLE = 2**22  # numbers that may be held at once
_BLOCK = 2**17  # numbers that stay in the cache


def in_blocks(function: Callable[[Array], tuple[Array, ...]], t: Array, width: int) -> tuple[Array, ...]:
    """The arrays (…, *t.shape) of a function that needs `width` numbers for each time, and treats times one by one.

    What fits into memory at once is left in one piece.
    """
    if t.size * width <= _WHOLE:
        return function(t)
    flat, height = t.reshape(-1), max(1, _BLOCK // width)
    blocks = [function(flat[i : i + height]) for i in range(0, flat.size, height)]
    joined = (np.concatenate(parts, axis=-1) for parts in zip(*blocks, strict=True))
    return tuple(array.reshape((*array.shape[:-1], *t.shape)) for array in joined)
