"""Draws from a normal distribution between bounds, by exact Hamiltonian Monte Carlo.

A. Pakman and L. Paninski: Exact Hamiltonian Monte Carlo for truncated multivariate Gaussians. Journal of Computational
and Graphical Statistics 23 (2014), 518–542. A particle at w gets a random velocity v, moves along w cos t + v sin t for
some time and is reflected by the bounds; where it is then is the next draw. All of this is in closed form: nothing is
rejected, and the truncated distribution is left as it is, up to rounding. The time is random, between π/4 and 3π/4
(there it is always π/2), as a particle that is reflected with just this period would return to where it was (R. M.
Neal, MCMC using Hamiltonian dynamics, 2011, says so of all such methods).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.bounded.least_norm import least_norm
from trackably.gp.bounded.particles import Particles, Walls

_CHAINS = 50
_BURN_IN = 25  # moves of each chain that are thrown away: without bounds, one would do
_INSIDE = 1e-6  # standard deviations from each bound to the start
_MOST_REFLECTIONS = 5_000  # of one particle in one move


class NoRoom(ArithmeticError):
    """Nothing lies between the bounds, or too little to draw from."""


@dataclass(frozen=True)
class BoundedNormal:
    """w ~ N(0, I) of dimension r on the side of all `walls` where N w + g ≥ 0."""

    walls: Walls

    @classmethod
    def between(cls, rows: Array, lower: Array, upper: Array) -> Self:
        """Return w ~ N(0, I), given `lower` ≤ D w ≤ `upper` with `rows` D (M, r) and bounds (M,), infinite or not.

        Raises NoRoom where a row is zero and its bounds exclude zero.
        """
        lengths = np.linalg.norm(rows, axis=1)
        if np.any((lengths == 0) & ((lower > 0) | (upper < 0))):
            raise NoRoom("a value without any uncertainty is outside of its bounds")
        normals, offsets = np.vstack([rows, -rows]), np.concatenate([-lower, upper])
        lengths = np.concatenate([lengths, lengths])
        some = (lengths > 0) & np.isfinite(offsets)
        return cls(Walls(normals[some] / lengths[some, None], offsets[some] / lengths[some]))

    @cached_property
    def start(self) -> Array:
        """The most likely w that is 1e-6 inside all bounds, (r,). Raises NoRoom: there is none, or it is not found."""
        try:
            found = least_norm(self.walls.normals, self.walls.offsets - _INSIDE)
        except np.linalg.LinAlgError as error:
            raise NoRoom(f"what is most likely between the bounds is not found in float64: {error}") from error
        if found is None:
            raise NoRoom(f"nothing lies inside all bounds by {_INSIDE:g} standard deviations")
        return found

    def draws(self, count: int, seed: int) -> Array:
        """Return `count` draws, shape (count, r): the same for the same seed, and the first of any larger count.

        They are of 50 independent chains in turn, after 25 moves of each: two draws depend on each other only if their
        indices differ by a multiple of 50. Raises NoRoom.
        """
        rng = np.random.default_rng(seed)
        w = np.tile(self.start, (_CHAINS, 1))
        kept = [np.empty((0, w.shape[1]))]
        for move in range(_BURN_IN + -(-count // _CHAINS)):
            w = self._moved(w, rng.standard_normal(w.shape), rng.uniform(np.pi / 4, 3 * np.pi / 4, len(w)))
            if move >= _BURN_IN:
                kept.append(w)
        return np.concatenate(kept)[:count]

    def _moved(self, w: Array, v: Array, left: Array) -> Array:
        """Return where particles from w with velocities v, both (P, r), are when the times `left` (P,) have passed."""
        moving, arrived_at = Particles.at(w, v, self.walls), np.empty_like(w)
        which = np.arange(len(w))
        for _ in range(_MOST_REFLECTIONS):
            free, wall = moving.next_wall(self.walls)
            moving, arrives = moving.after(np.minimum(free, left)), free >= left
            arrived_at[which[arrives]] = moving.w[arrives]
            if arrives.all():
                return arrived_at
            on = ~arrives
            which, left = which[on], (left - free)[on]
            moving = moving.those(on).reflected(wall[on], self.walls)
        raise NoRoom(
            f"{_MOST_REFLECTIONS} reflections do not end one move: the bounds are too close together, or too far out"
        )
