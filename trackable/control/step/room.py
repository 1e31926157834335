"""How much room a window leaves for errors inside the state and input sets."""

from dataclasses import dataclass

import numpy as np

from trackable.arrays import Array
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.reference import Window
from trackable.systems.sets.polytope import Polytope

_TIED = 1e-6


@dataclass(frozen=True, eq=False)
class Side:
    """{y : `rows` y ≤ `ends`} with rows (2r, n), and the `widths` upper − lower between each row and its opposite."""

    rows: Array
    ends: Array
    widths: Array

    @classmethod
    def of(cls, bounded: Polytope) -> "Side":
        """All (2r,) but the rows."""
        return cls(*bounded.inequalities, np.tile(bounded.upper - bounded.lower, 2))


@dataclass(frozen=True, eq=False)
class Sets:
    """The sets of a system as inequalities, written out once."""

    states: Side
    inputs: Side

    @classmethod
    def of(cls, plant: ConstrainedSystem) -> "Sets":
        """X and U."""
        return cls(Side.of(plant.state_set), Side.of(plant.input_set))


@dataclass(frozen=True, eq=False)
class Room:
    """H e(i) ≤ `states`(i−1) for i = 1 … N, shape (N, 2r), and G v(i) ≤ `inputs`(i) for i < N, shape (N, 2s).

    The state at hand, e(0), is bounded by nothing: no input changes it any more.
    """

    states: Array
    inputs: Array

    @classmethod
    def around(cls, sets: Sets, window: Window) -> "Room":
        """h − H x_r and g − G u_r."""
        X, U = sets.states, sets.inputs
        return cls(X.ends - window.states[1:] @ X.rows.T, U.ends - window.inputs @ U.rows.T)

    def widened(self, sets: Sets, by: float) -> "Room":
        """With every bound moved out `by` a part of its width."""
        return Room(self.states + by * sets.states.widths, self.inputs + by * sets.inputs.widths)

    def left(self, sets: Sets, errors: Array, inputs: Array) -> "Room":
        """What e(1), …, e(N) (N, n) and v(0), …, v(N−1) (N, m) leave of it in parts of the widths: < 0 outside."""
        X, U = sets.states, sets.inputs
        return Room((self.states - errors @ X.rows.T) / X.widths, (self.inputs - inputs @ U.rows.T) / U.widths)

    @property
    def least(self) -> float:
        """The smallest entry."""
        return float(min(np.min(self.states, initial=np.inf), np.min(self.inputs, initial=np.inf)))

    @property
    def tightest(self) -> tuple[int, int]:
        """Which row of the sets (first those of the states) is closest to its bound, and in how many steps.

        The first of those that tie.
        """
        N, r = len(self.states), self.states.shape[1] // 2
        both_sides = [values.reshape(N, 2, -1).min(axis=1) for values in (self.states, self.inputs)]
        by_step = np.full((N + 1, r + self.inputs.shape[1] // 2), np.inf)
        by_step[1:, :r], by_step[:-1, r:] = both_sides
        least = np.min(by_step)
        ahead, quantity = np.argwhere(by_step <= least + _TIED * (1 + abs(least)))[0].tolist()
        return quantity, ahead
