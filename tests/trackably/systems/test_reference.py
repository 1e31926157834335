"""A reference's own states and inputs: the system, driven by them, goes where they say."""

import numpy as np
import pytest

from tests.trackably.systems.instances import (
    controllable,
    random_signal,
    unbounded,
)
from trackably.systems.reference import Reference

STEPS = np.arange(3000)


@pytest.mark.parametrize("seed", range(8))
def test_every_step_of_a_random_system_lands_on_the_next(seed):
    rng, plant = np.random.default_rng(1000 + seed), unbounded(controllable(seed))
    reference = Reference(tuple(random_signal(rng) for _ in range(plant.signal_count)), plant)
    system, x, u = plant.system, reference.state(STEPS), reference.input(STEPS)
    assert (x.shape, u.shape) == ((3000, system.A.shape[0]), (3000, system.B.shape[1]))
    assert np.ptp(x) > 1e-3
    landed = system.successor(x[:-1], u[:-1])
    np.testing.assert_allclose(landed, x[1:], rtol=0, atol=1e-9 * np.max(np.abs(x)))
