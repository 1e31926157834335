"""Function and hyperparameters together cost no more than hyperparameters alone, on nonlinear systems too."""

import numpy as np
import pytest

from trackably import ConstrainedSystem, Polytope, Samples, SquaredExponential, learn_reference
from trackably.systems.library import tank


@pytest.mark.filterwarnings("ignore:the reference keeps its bounds but does not follow")
def test_it_costs_no_more_than_hyperparameters_alone_on_a_tank() -> None:
    times, rng = np.arange(0, 121, 8.0), np.random.default_rng(1)
    level = Samples(times, 0.7 + 0.35 * np.sin(times / 18) + 0.03 * rng.standard_normal(times.size))
    plant = ConstrainedSystem(tank(4.0, outflow=0.05), Polytope.box([0.3], [1.0]), Polytope.box([0.0], [0.075]))
    given = {"level": level}, plant, SquaredExponential(), (0.0, 120.0)
    together, alone = (
        learn_reference(*given, noise_std=0.03, mean=0.7, method=method, starts=2, progress=False)
        for method in ("joint", "hyperparameters")
    )
    assert alone.price > 1, "the bounds matter here"
    assert together.objective <= alone.objective + 1e-6 * (1 + abs(alone.objective))
