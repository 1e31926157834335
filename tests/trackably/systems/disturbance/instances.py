"""Systems with disturbance sets: full and flat ones, boxes, zonotopes, and hulls of vertices."""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from tests.trackably.systems.instances import controllable
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import ConvexHull, DisturbanceSet, Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.tightening import Tightening, tightening

EXAMPLE1 = ConstrainedSystem(
    LinearSystem.scalar(0.9, 0.5, sampling_time=0.01), Polytope.box([-2.0], [0.05]), Polytope.box([-0.5], [0.5])
)
CART = ConstrainedSystem(
    LinearSystem.discretised([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], 0.1, states=("position", "velocity")),
    Polytope.box([-1.0, -1.0], [1.0, 1.0]),
    Polytope.box([-2.0], [2.0]),
)
OBLIQUE = ConstrainedSystem(
    CART.system,
    Polytope.halfspaces([[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [0.0, 1.0]], [1.0, 1.0, 0.8, 0.8, 0.7]),
    Polytope.box([-2.0], [1.5]),
)


@dataclass(frozen=True)
class Disturbed:
    plant: ConstrainedSystem
    disturbance: DisturbanceSet

    @cached_property
    def tightening(self) -> Tightening:
        return tightening(self.plant, self.disturbance)


DISTURBED: dict[str, Disturbed] = {
    "example1": Disturbed(EXAMPLE1, Zonotope.box([-0.01], [0.01])),
    "one-sided": Disturbed(EXAMPLE1, Zonotope.box([-0.002], [0.01])),
    "pushed": Disturbed(CART, Zonotope.box([0.0, -0.05], [0.0, 0.05])),  # flat: the position is not disturbed
    "oblique": Disturbed(OBLIQUE, Zonotope([0.0, 0.0], [[0.004, 0.01], [0.0, 0.01], [0.002, -0.003]])),
    "triangle": Disturbed(CART, ConvexHull([[0.01, 0.0], [-0.01, 0.02], [0.0, -0.03]])),
    "cut corner": Disturbed(
        CART,
        ConvexHull([[0.01, 0.02], [0.01, -0.03], [0.0, 0.03], [-0.01, 0.03], [-0.01, -0.03]]),
    ),
}


def random_disturbed(seed: int) -> Disturbed:
    """Up to three states; every other W is flat, with fewer generators than states where that is possible."""
    rng = np.random.default_rng(seed)
    system = controllable(seed, states=3)
    n, m = system.B.shape
    plant = ConstrainedSystem(
        LinearSystem(system.A, system.B, sampling_time=0.05),
        Polytope.box(-rng.uniform(0.5, 2, n), rng.uniform(0.5, 2, n)),
        Polytope.box(-rng.uniform(5, 9, m), rng.uniform(5, 9, m)),
    )
    count = max(1, n - 1) if seed % 2 else n + 1
    if seed % 3:
        return Disturbed(plant, Zonotope(np.zeros(n), 1e-3 * rng.normal(size=(count, n))))
    return Disturbed(plant, ConvexHull(1e-3 * np.vstack([np.zeros(n), rng.normal(size=(count, n))])))


RANDOM = {f"random {seed}": random_disturbed(seed) for seed in range(4)}
ALL = {**DISTURBED, **RANDOM}


def scaled(W: DisturbanceSet, factor: Fraction) -> DisturbanceSet:
    """Return factor · W."""
    vectors = [[factor * value for value in of] for of in W.vectors]
    return ConvexHull(vectors) if isinstance(W, ConvexHull) else Zonotope(vectors[0], vectors[1:])
