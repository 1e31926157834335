"""Particles in the potential ‖w‖²/2 between walls: they move along w cos t + v sin t and are reflected."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array


@dataclass(frozen=True)
class Walls:
    """The walls N w + g = 0 of the region N w + g ≥ 0: `normals` N (W, r) of length one, `offsets` g (W,)."""

    normals: Array
    offsets: Array

    @cached_property
    def gram(self) -> Array:
        """N Nᵀ, shape (W, W)."""
        return np.asarray(self.normals @ self.normals.T)


@dataclass(frozen=True)
class Particles:
    """P particles: positions `w` and velocities `v` (P, r), and both along the normals, `height` and `rate` (P, W)."""

    w: Array
    v: Array
    height: Array
    rate: Array

    @classmethod
    def at(cls, w: Array, v: Array, walls: Walls) -> Self:
        return cls(w, v, w @ walls.normals.T, v @ walls.normals.T)

    def those(self, chosen: npt.NDArray[np.bool_]) -> Self:
        """Return the chosen ones only."""
        return type(self)(self.w[chosen], self.v[chosen], self.height[chosen], self.rate[chosen])

    def after(self, t: Array) -> Self:
        """Return all of them after times t (P,), as if there were no walls."""
        c, s = np.cos(t)[:, None], np.sin(t)[:, None]
        w, v = c * self.w + s * self.v, c * self.v - s * self.w
        return type(self)(w, v, c * self.height + s * self.rate, c * self.rate - s * self.height)

    def reflected(self, wall: npt.NDArray[np.intp], walls: Walls) -> Self:
        """Return them with velocities reflected, each at the `wall` of that index (P,)."""
        twice = 2 * self.rate[np.arange(len(wall)), wall][:, None]
        v, rate = self.v - twice * walls.normals[wall], self.rate - twice * walls.gram[wall]
        return type(self)(self.w, v, self.height, rate)

    def next_wall(self, walls: Walls) -> tuple[Array, npt.NDArray[np.intp]]:
        """Return when each particle leaves the region, and through which wall: (P,) both; infinity if it never does.

        h cos t + ḣ sin t = R cos(t − φ) falls below −g at t = φ + arccos(−g/R). A particle that falls towards a wall
        reaches it in less than π: if it seems to take longer, rounding has put it there, or just beyond.
        """
        times = np.full((len(self.w), len(walls.offsets) + 1), np.inf)
        radius = np.hypot(self.height, self.rate)
        p, j = np.nonzero(radius > walls.offsets)
        rate = self.rate[p, j]
        turn = np.arctan2(rate, self.height[p, j])
        t = (turn + np.arccos(np.clip(-walls.offsets[j] / radius[p, j], -1, 1))) % (2 * np.pi)
        times[p, j] = np.where((rate < 0) & (t > np.pi), 0.0, t)
        first = np.argmin(times, axis=1)
        return times[np.arange(len(first)), first], first
