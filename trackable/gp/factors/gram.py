"""Covariance matrices of samples at any times, with their derivatives: only the upper half is computed.

Rows are taken in strips that start at the diagonal. A strip is small enough to stay in the processor's cache.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trackable.arrays import Array
from trackable.gp.factors.factorisation import Block, Covariance

_ROWS = 64
_SMALL = 128  # rows: up to here one strip is as fast as two
_MULTIPLICITY = 2 * np.triu(np.ones((_SMALL, _SMALL)), 1) + np.eye(_SMALL)  # of upper entries in a symmetric matrix


@dataclass(frozen=True)
class Strips:
    """p symmetric matrices D_j of shape (n, n): strip i has rows 64 i … 64 i + 63 of each, from column 64 i on."""

    strips: tuple[Array, ...]

    def times(self, c: Array) -> Array:
        """Return D_j c for c of shape (n,): shape (p, n)."""
        if len(self.strips) == 1:
            return np.asarray(self.strips[0] @ c)
        product = np.zeros((len(self.strips[0]), len(c)))
        for rows, strip in zip(_rows(len(c)), self.strips, strict=True):
            right = strip[:, :, rows.stop - rows.start :]
            product[:, rows] += strip @ c[rows.start :]
            product[:, rows.stop :] += c[rows] @ right
        return product

    def traces(self, upper: Array) -> Array:
        """Return tr(M D_j), shape (p,), for a symmetric M; entries of `upper` below the diagonal are ignored."""
        if len(self.strips) == 1:
            (strip,), n = self.strips, len(upper)
            return np.asarray(strip.reshape(len(strip), -1) @ (upper * _MULTIPLICITY[:n, :n]).reshape(-1))
        trace = np.zeros(len(self.strips[0]))
        for rows, strip in zip(_rows(len(upper)), self.strips, strict=True):
            height = rows.stop - rows.start
            part = np.empty((height, len(upper) - rows.start))
            np.multiply(upper[rows, rows.start : rows.stop], _MULTIPLICITY[:height, :height], out=part[:, :height])
            np.multiply(upper[rows, rows.stop :], 2, out=part[:, height:])
            trace += strip.reshape(len(strip), -1) @ part.reshape(-1)
        return trace


class Gram(NamedTuple):
    """K on and above the diagonal (`upper`; undefined below), a `workspace` of its shape, and ∂K/∂ln θ_j."""

    upper: Array
    workspace: Array
    gradient: Strips


def gram(times: Array, covariance: Covariance) -> Gram:
    """Compute the covariance matrix of samples at n `times` [s], and its derivatives."""
    return gram_of_blocks(len(times), lambda rows, columns: covariance(times[rows, None] - times[columns]))


def gram_of_blocks(n: int, block: Block) -> Gram:
    """Compute a covariance matrix of n samples, and its derivatives, from its blocks.

    All large arrays share one piece of memory. Several pieces would go back to the operating system when freed, and
    getting them again, page by page, takes longer than computing their content.
    """
    memory, strips = np.empty(0), list[Array]()
    if n <= _SMALL:
        values, gradient = block(slice(0, n), slice(0, n))
        return Gram(values, np.empty((n, n)), Strips((gradient,)))
    for rows in _rows(n):
        values, gradient = block(rows, slice(rows.start, n))
        if not strips:
            sizes = [(r.stop - r.start) * (n - r.start) for r in _rows(n)]
            memory = np.empty(2 * n**2 + len(gradient) * sum(sizes))
            free = memory[2 * n**2 :]
        memory[: n**2].reshape(n, n)[rows, rows.start :] = values
        strips.append(free[: gradient.size].reshape(gradient.shape))
        strips[-1][...] = gradient
        free = free[gradient.size :]
    upper, workspace = memory[: 2 * n**2].reshape(2, n, n)
    return Gram(upper, workspace, Strips(tuple(strips)))


def _rows(n: int) -> Iterator[slice]:
    height = _ROWS if n > _SMALL else n
    return (slice(start, min(start + height, n)) for start in range(0, n, height))
