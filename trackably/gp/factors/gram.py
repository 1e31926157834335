"""Covariance matrices of samples with their derivatives, each entry once, computed in parts that stay in the cache."""

from typing import NamedTuple

import numpy as np

from trackably.arrays import Array
from trackably.gp.factors.factorisation import Entries
from trackably.gp.factors.packed import Symmetric

_PART = 2**13  # entries


class Gram(NamedTuple):
    """The stored entries of K, and ∂K/∂ln θ_j."""

    entries: Array
    gradient: Symmetric


def gram(n: int, entries: Entries) -> Gram:
    """Compute the covariance matrix of n samples, and its derivatives.

    All large arrays share one piece of memory. Several pieces would go back to the operating system when freed, and
    getting them again, page by page, takes longer than computing their content.
    """
    count = n * (n + 1) // 2
    first, gradient = entries(slice(_PART))
    if count <= _PART:
        return Gram(first, Symmetric(gradient))
    memory = np.empty((1 + len(gradient), count))
    memory[0, :_PART], memory[1:, :_PART] = first, gradient
    for start in range(_PART, count, _PART):
        part = slice(start, start + _PART)
        memory[0, part], memory[1:, part] = entries(part)
    return Gram(memory[0], Symmetric(memory[1:]))
