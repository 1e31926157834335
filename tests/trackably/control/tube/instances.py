"""Robust references: constant and moving ones, whose plant is the tightened one."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pipeline.loops.disturbed import near_bounds
from tests.trackably.systems.disturbance.instances import CART, EXAMPLE1, random_disturbed
from trackably.control.controller import Controller
from trackably.control.tube import TubeController
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import ConvexHull, DisturbanceSet, Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening, tightening

STEPS = 40


@dataclass(frozen=True)
class Loop:
    """A plant and its disturbance; the reference moves by a `part` of the way to the nearest tightened bound."""

    plant: ConstrainedSystem
    disturbance: DisturbanceSet
    part: float = 0.999
    horizon: int = 12
    noise: Zonotope | None = None

    @cached_property
    def tightening(self) -> Tightening:
        return tightening(self.plant, self.disturbance, noise=self.noise)

    @cached_property
    def controller(self) -> TubeController:
        nominal = Controller(self.tightening.plant, self.horizon)
        return TubeController(self.tightening, self.horizon, nominal.Q, nominal.R)

    @cached_property
    def reference(self) -> Reference:
        return near_bounds(self.tightening.plant, np.random.default_rng(1), STEPS + self.horizon + 1, self.part)


HULL = ConvexHull([side * g for g in random_disturbed(7).disturbance.generator_matrix for side in (1, -0.5)])
"""Of points in three dimensions; the pushes in one direction are smaller."""

TWO_CARTS = ConstrainedSystem(
    LinearSystem(np.kron(np.eye(2), CART.system.A), np.kron(np.eye(2), CART.system.B), sampling_time=0.1),
    Polytope.box([-1.0, -1.0, -2.0, -1.5], [1.0, 1.0, 1.0, 1.0]),
    Polytope.box([-2.0, -3.0], [2.0, 2.0]),
)
"""Of errors that have nothing to do with each other: Z is a product of two polygons."""

LOOPS: dict[str, Loop] = {
    "example1": Loop(EXAMPLE1, Zonotope.box([-0.01], [0.01])),
    "pushed cart": Loop(CART, Zonotope.box([0.0, -0.05], [0.0, 0.05])),
    "pushed to one side": Loop(CART, Zonotope.box([0.0, -0.02], [0.0, 0.05])),
    "triangle": Loop(CART, ConvexHull([[0.01, 0.0], [-0.01, 0.02], [0.0, -0.03]])),
    "three states": Loop(random_disturbed(7).plant, random_disturbed(7).disturbance),
    "three states, a hull": Loop(random_disturbed(7).plant, HULL),
    "two carts": Loop(TWO_CARTS, Zonotope.box([0.0, -0.02, 0.0, -0.03], [0.0, 0.02, 0.0, 0.03])),
    "another": Loop(random_disturbed(4).plant, random_disturbed(4).disturbance),
}
