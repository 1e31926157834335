"""Draws from a normal distribution truncated by bounds, by exact Hamiltonian Monte Carlo.

A. Pakman and L. Paninski: Exact Hamiltonian Monte Carlo for truncated multivariate Gaussians. Journal of Computational
and Graphical Statistics 23 (2014), 518–542. A particle at w gets a random velocity v, moves along w cos t + v sin t for
some time, and is reflected by the bounds; its position at the end is the next draw. The motion is known in closed form:
nothing is rejected, and the truncated distribution is invariant, up to rounding. In the paper, the time of a move is
always π/2. Here it is random, between π/4 and 3π/4, because a reflected particle whose period is the fixed time would
return to its start (R. M. Neal, MCMC using Hamiltonian dynamics, 2011, warns of this for Hamiltonian methods).

Chains start at the shortest w within the bounds: the most likely admissible value. A root of a covariance maps
independent standard normal numbers to values with this covariance.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from benchmarks.rivals.model import NotFound
from trackably.arrays import Array
from trackably.gp.bounded import least_norm

_NEGLIGIBLE = 1e-12  # smaller eigenvalues, relative to the largest, are dropped: they are rounding errors


def root(covariance: Array) -> Array:
    """Return F (n, r) with F Fᵀ = Σ, up to 1e-12 n of each variance, for a covariance Σ (n, n) of any rank.

    F has few columns where the values depend on each other, as those of a smooth process at close times do. Rows are
    scaled to the same variance before, so that their units do not matter.
    """
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(std > 0, std, np.inf)
    values, vectors = np.linalg.eigh(covariance / scale / scale[:, None])
    kept = values > _NEGLIGIBLE * values[-1]
    return np.asarray(std[:, None] * vectors[:, kept] * np.sqrt(values[kept]))


_CHAINS = 50  # independent chains, which move at the same time
_BURN_IN = 25  # first moves of each chain, which are discarded; without bounds, one would suffice
_INSIDE = 1e-6  # standard deviations: distance of the start from each bound
_MOST_REFLECTIONS = 5_000  # of one particle in one move; if it needs more, the region is too small to draw from


@dataclass(frozen=True)
class BoundedNormal:
    """w ~ N(0, I) of dimension r, given `lower` ≤ D w ≤ `upper` for `rows` D (M, r) and bounds (M,), maybe infinite."""

    rows: Array
    lower: Array
    upper: Array

    @cached_property
    def start(self) -> Array:
        """The most likely w (r,) that is 1e-6 standard deviations away from all bounds. NotFound: there is none."""
        normals, offsets = (of[np.isfinite(self.walls[1])] for of in self.walls)
        # A row of zeros cannot vary: it needs no distance from its bounds.
        found = least_norm(normals, offsets - _INSIDE * np.any(normals, axis=1))
        if found is None:
            raise NotFound("failed", f"no draws: no draw is inside all bounds by {_INSIDE:g} standard deviations")
        return found

    @cached_property
    def walls(self) -> tuple[Array, Array]:
        """Normals N (2M, r) of length one, or zero, and offsets g (2M,) of the bounds N w + g ≥ 0."""
        normals, offsets = np.vstack([self.rows, -self.rows]), np.concatenate([-self.lower, self.upper])
        lengths = np.linalg.norm(normals, axis=1)
        unit = np.where(lengths > 0, lengths, 1.0)
        return normals / unit[:, None], offsets / unit

    def draws(self, count: int, seed: int) -> Array:
        """Return `count` draws, shape (count, r).

        A seed gives the same draws every time; a larger count gives the same draws and more.

        They come from 50 independent chains in turn, after 25 moves of each: two draws depend on each other only if
        their indices differ by a multiple of 50. Raises NotFound.
        """
        rng = np.random.default_rng(seed)
        w = np.tile(self.start, (_CHAINS, 1))
        kept = [np.empty((0, w.shape[1]))]
        for move in range(_BURN_IN + -(-count // _CHAINS)):
            w = self._move(w, rng.standard_normal(w.shape), rng.uniform(np.pi / 4, 3 * np.pi / 4, len(w)))
            if move >= _BURN_IN:
                kept.append(w)
        return np.concatenate(kept)[:count]

    def _move(self, w: Array, v: Array, left: Array) -> Array:
        """Return the positions after times `left` (P,) of particles that start at w with velocities v, both (P, r)."""
        arrived_at, which = np.empty_like(w), np.arange(len(w))
        for _ in range(_MOST_REFLECTIONS):
            free, wall = self._next_wall(w, v)
            c, s = (of(np.minimum(free, left))[:, None] for of in (np.cos, np.sin))
            w, v, arrives = c * w + s * v, c * v - s * w, free >= left
            arrived_at[which[arrives]] = w[arrives]
            if arrives.all():
                return arrived_at
            which, left, w, v = which[~arrives], (left - free)[~arrives], w[~arrives], v[~arrives]
            normal = self.walls[0][wall[~arrives]]
            # The velocity after the reflection.
            v -= 2 * np.sum(v * normal, axis=1, keepdims=True) * normal
        raise NotFound("failed", f"no draws: a draw takes over {_MOST_REFLECTIONS} reflections")

    def _next_wall(self, w: Array, v: Array) -> tuple[Array, npt.NDArray[np.intp]]:
        """Return the time at which each particle leaves the region (∞ if never), and the index of the bound, its wall.

        Both have the shape (P,). With h = n · w and ḣ = n · v for the normal n and the offset g of a wall,
        h cos t + ḣ sin t = R cos(t − φ) falls below −g at t = φ + arccos(−g/R). A particle that moves towards a wall
        reaches it in less than π. If the computed time is longer, rounding has put the particle on the wall or just
        beyond, and it leaves now.
        """
        normals, offsets = self.walls
        height, rates = w @ normals.T, v @ normals.T
        times = np.full(height.shape, np.inf)
        radius = np.hypot(height, rates)
        p, j = np.nonzero(radius > offsets)
        rate = rates[p, j]
        turn = np.arctan2(rate, height[p, j])
        t = (turn + np.arccos(np.clip(-offsets[j] / radius[p, j], -1, 1))) % (2 * np.pi)
        times[p, j] = np.where((rate < 0) & (t > np.pi), 0.0, t)
        first = np.argmin(times, axis=1)
        return times[np.arange(len(first)), first], first
