"""Function and hyperparameters together cost no more than hyperparameters alone, on nonlinear systems too."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from tests.trackably.gp.instances import over
from trackably import ConstrainedSystem, Polytope, Samples, SquaredExponential, learn_reference
from trackably.systems.library import pendulum, tank


class Instance(NamedTuple):
    """A system in boxes, and a signal around `mean` that its samples show, with noise."""

    plant: ConstrainedSystem
    sampled: str
    signal: Callable[[np.ndarray], np.ndarray]
    times: np.ndarray
    mean: float
    noise_std: float


INSTANCES = {
    "tank": Instance(
        ConstrainedSystem(tank(4.0, outflow=0.05), Polytope.box([0.3], [1.0]), Polytope.box([0.0], [0.075])),
        "level",
        lambda t: 0.7 + 0.35 * np.sin(t / 18),
        np.arange(0, 121, 8.0),
        0.7,
        0.03,
    ),
    "pendulum": Instance(
        ConstrainedSystem(pendulum(0.1), Polytope.box([-2.0, -1.0], [2.0, 1.0]), Polytope.box([-0.9], [0.9])),
        "angle",
        lambda t: 0.8 * np.sin(1.5 * t),
        np.arange(0, 4.01, 0.4),
        0.0,
        0.03,
    ),
}


@pytest.mark.filterwarnings("ignore:the reference keeps its bounds but does not follow")
@over(INSTANCES, "instance")
def test_it_costs_no_more_than_hyperparameters_alone(instance: Instance) -> None:
    noise = instance.noise_std * np.random.default_rng(1).standard_normal(instance.times.size)
    samples = {instance.sampled: Samples(instance.times, instance.signal(instance.times) + noise)}
    window = (0.0, float(instance.times[-1]))
    together, alone = (
        learn_reference(
            samples,
            instance.plant,
            SquaredExponential(),
            window,
            noise_std=instance.noise_std,
            mean=instance.mean,
            method=method,
            starts=2,
            progress=False,
        )
        for method in ("joint", "hyperparameters")
    )
    assert alone.price > 1, "the bounds matter here"
    assert together.objective <= alone.objective + 1e-6 * (1 + abs(alone.objective))
