"""Covariance matrices of samples at any times, with their derivatives: half of each symmetric matrix is never computed.

Rows are taken in strips, each from the diagonal on: small enough that what is computed of a strip stays in the cache.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trackable.arrays import Array
from trackable.gp.factors.factored import Covariance

_ROWS = 64
_SMALL = 128  # rows: so few are one strip, as two of them take as long as what they save
_COUNTED = 2 * np.triu(np.ones((_SMALL, _SMALL)), 1) + np.eye(_SMALL)  # how often in a symmetric matrix, from above


@dataclass(frozen=True)
class Strips:
    """p symmetric matrices D_j of shape (n, n): strip i holds rows 64 i … 64 i + 63 of each, from column 64 i on."""

    strips: tuple[Array, ...]

    def times(self, c: Array) -> Array:
        """D_j c for c of shape (n,): shape (p, n)."""
        if len(self.strips) == 1:
            return np.asarray(self.strips[0] @ c)
        product = np.zeros((len(self.strips[0]), len(c)))
        for rows, strip in zip(_rows(len(c)), self.strips, strict=True):
            right = strip[:, :, rows.stop - rows.start :]
            product[:, rows] += strip @ c[rows.start :]
            product[:, rows.stop :] += c[rows] @ right
        return product

    def contracted(self, upper: Array) -> Array:
        """tr(M D_j), shape (p,), for a symmetric M that is given on and above its diagonal; below it, any numbers."""
        trace = np.zeros(len(self.strips[0]))
        for rows, strip in zip(_rows(len(upper)), self.strips, strict=True):
            height = rows.stop - rows.start
            part = np.empty((height, len(upper) - rows.start))
            np.multiply(upper[rows, rows.start : rows.stop], _COUNTED[:height, :height], out=part[:, :height])
            np.multiply(upper[rows, rows.stop :], 2, out=part[:, height:])
            trace += strip.reshape(len(strip), -1) @ part.reshape(-1)
        return trace


class Gram(NamedTuple):
    """K on and above the diagonal (`upper`, anything below), room for as much again, and ∂K/∂ln θ_j."""

    upper: Array
    room: Array
    gradient: Strips


def gram(times: Array, covariance: Covariance) -> Gram:
    """The covariance of samples at n `times` [s].

    What is large shares one piece of memory, with room for the inverse. What is freed in several pieces goes back to
    the system, and to get it again, page by page, takes longer than to compute what is in it.
    """
    n, memory, strips = len(times), np.empty(0), list[Array]()
    if n <= _SMALL:
        values, gradient = covariance(times[:, None] - times)
        return Gram(values, np.empty((n, n)), Strips((gradient,)))
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
    height = _ROWS if n > _SMALL else n
    return (slice(start, min(start + height, n)) for start in range(0, n, height))
