"""Evaluate functions of many times block by block, in bounded memory."""

from collections.abc import Callable

import numpy as np

from trackably.arrays import Array

_WHOLE = 2**16  # numbers for which one call is faster than several
_BLOCK = 2**15  # numbers that stay in the cache: larger arrays are fetched from memory for each operation


def in_blocks(
    function: Callable[[Array], tuple[Array, ...]], t: Array, width: int, most: int | None = None
) -> tuple[Array, ...]:
    """Evaluate a function of times t (any shape) that returns arrays (…, *t.shape), block by block.

    The function must treat each time separately; it needs `width` numbers of memory for each. If all of them fit into
    memory, or are no more than `most`, it is called once.
    """
    if t.size * width <= (most or _WHOLE):
        return function(t)
    flat, height = t.reshape(-1), max(1, (most or _BLOCK) // width)
    blocks = [function(flat[i : i + height]) for i in range(0, flat.size, height)]
    joined = (np.concatenate(parts, axis=-1) for parts in zip(*blocks, strict=True))
    return tuple(array.reshape((*array.shape[:-1], *t.shape)) for array in joined)
