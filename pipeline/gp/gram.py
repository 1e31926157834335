"""Covariance matrices of samples at any times, with their derivatives: half of each symmetric matrix is never computed.

Rows are taken in strips, each from the diagonal on: small enough that what is computed of a strip stays in the cache.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pipeline.arrays import Array
from pipeline.gp.factored import Covariance

_ROWS = 64
_BELOW = np.tri(_ROWS, k=-1, dtype=bool)


@dataclass(frozen=True)
class Strips:
    """p symmetric matrices D_j of shape (n, n): strip i holds rows 64 i … 64 i + 63 of each, from column 64 i on."""

    strips: tuple[Array, ...]

    def times(self, c: Array) -> Array:
        """D_j c for c of shape (n,): shape (p, n)."""
        product = np.zeros((len(self.strips[0]), len(c)))
        for rows, strip in zip(_rows(len(c)), self.strips, strict=True):
            right = strip[:, :, rows.stop - rows.start :]
            product[:, rows] += strip @ c[rows.start :]
            product[:, rows.stop :] += c[rows] @ right
        return product

    def contracted(self, upper: Array, c: Array) -> Array:
        """tr((M − c cᵀ) D_j), shape (p,), for a symmetric M that is given on and above its diagonal."""
        trace = np.zeros(len(self.strips[0]))
        for rows, strip in zip(_rows(len(c)), self.strips, strict=True):
            height = rows.stop - rows.start
            inner = upper[rows, rows.start :] - c[rows, None] * c[rows.start :]
            square, right = inner[:, :height], inner[:, height:]
            np.copyto(square, square.T, where=_BELOW[:height, :height])
            right *= 2  # it stands for what is below the diagonal, too
            trace += np.einsum("ij,pij->p", inner, strip)
        return trace


class Gram(NamedTuple):
    """K on and above the diagonal (`upper`, anything below), room for as much again, and ∂K/∂ln θ_j."""

    upper: Array
    room: Array
    gradient: Strips


def gram(times: Array, covariance: Covariance) -> Gram:
    """The covariance of samples at n `times` [s].

    All of it shares one piece of memory, with room for the inverse. What is freed in several pieces goes back to the
    system, and to get it again, page by page, takes longer than to compute what is in it.
    """
    n, memory, strips = len(times), np.empty(0), list[Array]()
    for rows in _rows(n):
        values, gradient = covariance(times[rows, None] - times[rows.start :])
        if not strips:
            sizes = [(r.stop - r.start) * (n - r.start) for r in _rows(n)]
            memory = np.empty(2 * n**2 + len(gradient) * sum(sizes))
            free = memory[2 * n**2 :]
        memory[: n**2].reshape(n, n)[rows, rows.start :] = values
        strips.append(free[: gradient.size].reshape(gradient.shape))
        strips[-1][...] = gradient
        free = free[gradient.size :]
    upper, room = memory[: 2 * n**2].reshape(2, n, n)
    return Gram(upper, room, Strips(tuple(strips)))


def _rows(n: int) -> Iterator[slice]:
    return (slice(start, min(start + _ROWS, n)) for start in range(0, n, _ROWS))
