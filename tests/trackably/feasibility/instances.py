"""Random plants in any units, and trajectories that keep their bounds."""

import numpy as np

from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope


def random_plant(rng: np.random.Generator) -> ConstrainedSystem:
    n, m = int(rng.integers(1, 5)), int(rng.integers(1, 3))
    A = rng.normal(size=(n, n))
    A *= rng.uniform(0.5, 1.2) / np.abs(np.linalg.eigvals(A)).max()
    system = LinearSystem(A, rng.normal(size=(n, min(n, m))), rng.normal(size=n) / 20, sampling_time=0.1)
    x, u = 10.0 ** rng.uniform(-3, 3, n), 10.0 ** rng.uniform(-3, 3, min(n, m))
    scaled = LinearSystem(A * x[:, None] / x, system.B * x[:, None] / u, system.c * x, sampling_time=0.1)
    u *= rng.uniform(0.05, 1.0)
    skew = np.vstack([np.eye(n), np.ones(n)]) / x
    return ConstrainedSystem(scaled, Polytope(skew, -np.ones(n + 1), np.ones(n + 1)), Polytope.box(-u, u))


def trajectory(plant: ConstrainedSystem, rng: np.random.Generator, count: int) -> list[np.ndarray]:
    """The states of a random admissible trajectory, as many steps as it stays inside."""
    x = np.zeros(len(plant.system.states))
    found = [x]
    for _ in range(count - 1):
        u = rng.uniform(plant.input_set.lower, plant.input_set.upper) * rng.uniform(0, 0.3)
        x = plant.linear.successor(x, u)
        if plant.state_set.margin(x) < 0:
            break
        found.append(x)
    return found
