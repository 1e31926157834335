"""The slack that a reference leaves for errors inside the state set and the input set."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Window
from trackably.systems.sets.polytope import Polytope

_TIE = 1e-6
"""Slacks that differ by less than this count as equal."""


@dataclass(frozen=True, eq=False)
class Inequalities:
    """The polytope {y : `rows` y ≤ `bounds`}, with rows of shape (2r, n) and bounds (2r,).

    `widths` (2r,) are the distances upper − lower between each row's bound and the opposite one.
    """

    rows: Array
    bounds: Array
    widths: Array

    @classmethod
    def of(cls, polytope: Polytope) -> "Inequalities":
        """Write a polytope lower ≤ rows y ≤ upper as inequalities."""
        return cls(*polytope.inequalities, np.tile(polytope.widths, 2))


@dataclass(frozen=True, eq=False)
class PlantInequalities:
    """The state set X and the input set U as inequalities."""

    states: Inequalities
    inputs: Inequalities

    @classmethod
    def of(cls, plant: ConstrainedSystem) -> "PlantInequalities":
        return cls(Inequalities.of(plant.state_set), Inequalities.of(plant.input_set))


@dataclass(frozen=True, eq=False)
class Slack:
    """Bounds of the errors, in parts of the widths w: H e(i) / w ≤ `states`(i−1) for i = 1 … N, shape (N, 2r), and
    G v(i) / w ≤ `inputs`(i) for i < N, shape (N, 2s).

    The current error e(0) is not bounded, because no input changes it any more.
    """

    states: Array
    inputs: Array

    @classmethod
    def along(cls, inequalities: PlantInequalities, window: Window) -> "Slack":
        """Return (h − H x_r) / w and (g − G u_r) / w along the window of a reference."""
        X, U = inequalities.states, inequalities.inputs
        states, inputs = X.bounds - window.states[1:] @ X.rows.T, U.bounds - window.inputs @ U.rows.T
        return cls(states / X.widths, inputs / U.widths)

    def widened(self, by: float) -> "Slack":
        """Move every bound outwards, `by` a part of its width."""
        return Slack(self.states + by, self.inputs + by)

    def remaining(self, inequalities: PlantInequalities, errors: Array, input_errors: Array) -> "Slack":
        """Return the slack left by e(1), …, e(N) (N, n) and v(0), …, v(N−1) (N, m): negative where one violates its
        bound."""
        X, U = inequalities.states, inequalities.inputs
        return Slack(self.states - errors @ X.rows.T / X.widths, self.inputs - input_errors @ U.rows.T / U.widths)

    @property
    def smallest(self) -> float:
        """The smallest slack of all; infinite where nothing is bounded."""
        return float(min(np.min(self.states, initial=np.inf), np.min(self.inputs, initial=np.inf)))

    @property
    def tightest(self) -> tuple[int, int]:
        """The quantity with the smallest slack, and the number of steps ahead at which it has it.

        Quantities are the rows of the sets, those of the states first. Of equal slacks the earliest counts.
        """
        N, r = len(self.states), self.states.shape[1] // 2
        both_sides = [values.reshape(N, 2, -1).min(axis=1) for values in (self.states, self.inputs)]
        by_step = np.full((N + 1, r + self.inputs.shape[1] // 2), np.inf)
        by_step[1:, :r], by_step[:-1, r:] = both_sides
        smallest = np.min(by_step)
        steps_ahead, quantity = np.argwhere(by_step <= smallest + _TIE * (1 + abs(smallest)))[0].tolist()
        return quantity, steps_ahead
