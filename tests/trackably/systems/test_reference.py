"""A reference's own states and inputs: the system, driven by them, goes where they say."""

import numpy as np
import pytest

from pipeline.published.scalar import (
    equilibrium_input,
    state_and_input,
)
from tests.trackably.gp.instances import over
from tests.trackably.systems.instances import (
    PLANTS,
    controllable,
    random_signal,
    unbounded,
)
from trackably.systems.reference import Reference


@over(PLANTS, "plant")
@pytest.mark.parametrize("level", [-0.4, 0.0, 1.1])
def test_at_rest_a_quantity_is_that_of_a_constant_signal(plant, level):
    state, entry = state_and_input(plant)
    for quantity in (state, entry):
        assert quantity.functional.at_rest([level]) == pytest.approx(
            float(quantity((lambda t: np.full_like(t, level),), np.array(0.3))), abs=1e-13
        )
    assert state.functional.at_rest([level]) == level
    assert entry.functional.at_rest([level]) == pytest.approx(equilibrium_input(plant, level), abs=1e-13)


# Systems with several states and inputs.

STEPS = np.arange(3000)


def general(seed: int) -> Reference:
    rng, system = np.random.default_rng(1000 + seed), controllable(seed)
    plant = unbounded(system)
    return Reference(tuple(random_signal(rng) for _ in range(plant.signal_count)), plant)


@pytest.mark.parametrize("seed", range(16))
def test_every_step_of_a_random_system_lands_on_the_next(seed):
    reference = general(seed)
    system, x, u = reference.plant.system, reference.state(STEPS), reference.input(STEPS)
    assert (x.shape, u.shape) == ((3000, system.A.shape[0]), (3000, system.B.shape[1]))
    assert np.ptp(x) > 1e-3
    landed = system.successor(x[:-1], u[:-1])
    np.testing.assert_allclose(landed, x[1:], rtol=0, atol=1e-9 * np.max(np.abs(x)))
