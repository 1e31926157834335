"""Points that are in a set exactly, in floating point, and not only up to a solver's tolerance."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.control.step.scales import middle
from trackably.control.step.slack import Inequalities
from trackably.systems.sets.polytope import Polytope
from trackably.systems.sets.scales import unit_scales

_SHRINK = 1 - 2.0**-50
"""Keeps the rounding of `pull_inside` from leading out of the set again."""


@dataclass(frozen=True, eq=False)
class AdmissiblePoints:
    """The points of a set: of the input set, or of the state set."""

    bounded: Polytope

    def pull_inside(self, u: Array) -> Array:
        """Return `u` (m,) if it is in the set; else the last point of the set on the line from its centre to u.

        A solver's u is outside by its tolerance only. For a box the result then equals clipping, up to that tolerance.
        """
        if self.bounded.margin(u) >= 0:
            return u
        inequalities = Inequalities.of(self.bounded)
        outward = inequalities.rows @ (u - self.centre)
        slack = inequalities.bounds - inequalities.rows @ self.centre
        crossed = outward > slack
        part = np.min(slack[crossed] / outward[crossed], initial=1.0)  # 1 where only rounding crosses a bound
        return np.asarray(self.centre + _SHRINK * part * (u - self.centre))

    def first_finite(self, points: Iterable[Array]) -> Array:
        """Return the first of some points (m,) that is finite, pulled inside; the centre if none is."""
        return next((self.pull_inside(u) for u in points if np.all(np.isfinite(u))), self.centre)

    @cached_property
    def centre(self) -> Array:
        """The point with the largest distance to all bounds, measured in their widths: shape (m,)."""
        near, given, m = middle(self.bounded), Inequalities.of(self.bounded), self.bounded.dimension
        if not len(given.rows):
            return near
        scale = unit_scales(self.bounded)
        program = scipy.optimize.linprog(  # in scales, because its tolerances are absolute
            np.append(np.zeros(m), -1.0),
            A_ub=np.column_stack([given.rows * scale / given.widths[:, None], np.ones(len(given.rows))]),
            b_ub=(given.bounds - given.rows @ near) / given.widths,
            bounds=[(None, None)] * (m + 1),
            method="highs",
        )
        return np.asarray(near + scale * np.asarray(program.x)[:m])
