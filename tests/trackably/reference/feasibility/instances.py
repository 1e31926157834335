"""Random linear systems of all sizes and units, with admissible trajectories."""

from typing import Any

import numpy as np

from trackably import ConstrainedSystem, LinearSystem, Polytope
from trackably.checker.certificate import Window
from trackably.reference.waypoints import Waypoints


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


def trajectory(rng: np.random.Generator) -> tuple[ConstrainedSystem, Window, Waypoints]:
    """A random plant, and some states of an admissible trajectory as values, until it leaves its set."""
    plant = random_plant(rng)
    x, at, step = np.zeros(len(plant.system.states)), dict[float, Any](), 0
    while step < 12 and plant.state_set.margin(x) >= 0:
        if step == 0 or rng.random() < 0.6:
            at[0.1 * step] = dict(zip(plant.system.states, x.tolist(), strict=True))
        x = plant.linear.successor(x, rng.uniform(plant.input_set.lower, plant.input_set.upper) * rng.uniform(0, 0.3))
        step += 1
    return plant, Window(0.0, 0.1 * max(1, step - 1)), at
