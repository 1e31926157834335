"""Robust references: constant and moving ones, whose plant is the tightened one."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tests.trackably.systems.disturbance.instances import CART, EXAMPLE1, random_disturbed
from trackably.control.controller import scaled_controller
from trackably.control.tube import TubeController
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import ConvexHull, DisturbanceSet, Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening, tightening

STEPS = 60


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
        nominal = scaled_controller(self.tightening.plant, self.horizon)
        return TubeController(self.tightening, self.horizon, nominal.Q, nominal.R)

    @cached_property
    def reference(self) -> Reference:
        """Signals scaled such that they come as near to the tightened bounds as `part` says, from a rest in zero."""
        plant, t_s = self.tightening.plant, self.plant.sampling_time
        centres = t_s * np.linspace(0, STEPS, 9)
        kernel = SquaredExponential(1.0, t_s * STEPS / 7)
        rng = np.random.default_rng(1)
        wild = tuple(
            KernelSum(kernel, 0.0, centres, rng.standard_normal(centres.size)) for _ in range(plant.signal_count)
        )
        moved = Reference(wild, plant)
        k = np.arange(STEPS + self.horizon + 2)
        used = [
            np.max(values @ bounded.rows.T / np.where(values @ bounded.rows.T > 0, bounded.upper, bounded.lower))
            for values, bounded in ((moved.state(k), plant.state_set), (moved.input(k), plant.input_set))
        ]
        by = self.part / max(used)
        return Reference(tuple(KernelSum(s.kernel, 0.0, s.centres, by * s.weights) for s in wild), plant)


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
