"""Inputs that are admissible to the last bit of what is stored, not only to a solver's tolerance."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import linprog

from trackable.arrays import Array
from trackable.control.step.room import Side
from trackable.systems.sets.polytope import Polytope

_INSIDE = 1 - 2.0**-50
"""Rounding of the line below must not lead out again."""


@dataclass(frozen=True, eq=False)
class Admissible:
    """An input set, as the place that an input is pulled into."""

    bounded: Polytope

    def nearest(self, u: Array) -> Array:
        """`u` (m,) itself if it is in the set; else the last point of the set from its centre towards u.

        Of a box with a solver's u a hair outside, this is the same as clipping, up to the same hair.
        """
        if self.bounded.margin(u) >= 0:
            return u
        side = Side.of(self.bounded)
        outward, room = side.rows @ (u - self.centre), side.ends - side.rows @ self.centre
        crossed = outward > room
        nearest = np.min(room[crossed] / outward[crossed], initial=1.0)  # 1 where only rounding has crossed a bound
        return np.asarray(self.centre + _INSIDE * nearest * (u - self.centre))

    @cached_property
    def centre(self) -> Array:
        """The point with the largest distance to all bounds, measured in their widths."""
        side = Side.of(self.bounded)
        m = self.bounded.dimension
        program = linprog(
            np.append(np.zeros(m), -1.0),
            A_ub=np.column_stack([side.rows, side.widths]),
            b_ub=side.ends,
            bounds=[(None, None)] * (m + 1),
            method="highs",
        )
        return np.asarray(program.x)[:m]
