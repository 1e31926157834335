"""Disturbances for simulations: drawn, constant, or the worst against the nearest bound."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.control.bounds import Inequalities
from trackably.systems.disturbances import DisturbanceSet
from trackably.systems.polytopes import Polytope


@dataclass(frozen=True, eq=False)
class Drawn:
    """Points of a set, the same for the same seed; every call draws another one."""

    disturbance: DisturbanceSet
    seed: int

    def __call__(self, k: int, successor: Array) -> Array:
        return self.disturbance.draw(self._generator)

    @cached_property
    def _generator(self) -> np.random.Generator:
        return np.random.default_rng(self.seed)


@dataclass(frozen=True, eq=False)
class Constant:
    """At all steps the point of a set that lies farthest in the direction of `row` (n,)."""

    disturbance: DisturbanceSet
    row: Array

    def __call__(self, k: int, successor: Array) -> Array:
        return self.disturbance.farthest(self.row)


@dataclass(frozen=True, eq=False)
class Greedy:
    """The point of a set that takes the state furthest towards the bound that is nearest, in parts of the widths."""

    disturbance: DisturbanceSet
    state_set: Polytope

    def __call__(self, k: int, successor: Array) -> Array:
        X = self._inequalities
        nearest = int(np.argmin((X.bounds - X.rows @ successor) / X.widths))
        return self.disturbance.farthest(X.rows[nearest])

    @cached_property
    def _inequalities(self) -> Inequalities:
        return Inequalities.of(self.state_set)
