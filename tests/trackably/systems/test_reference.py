"""A reference's own states and inputs: the system, driven by them, goes where they say."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pipeline.published.scalar import (
    coefficients,
    equilibrium_input,
    interval_sets,
    reachable_tube,
    state_and_input,
)
from tests.trackably.gp.instances import over
from tests.trackably.systems.instances import (
    PLANTS,
    SIGNAL,
    controllable,
    plants,
    random_signal,
    unbounded,
)
from trackably.gp.kernels.matern import Matern52
from trackably.gp.signal import KernelSum
from trackably.systems.reference import Reference

TIMES = np.linspace(-0.2, 2.0, 45)


@over(PLANTS, "plant")
def test_quantities_against_their_formulas(plant):
    (a, b, c), (state, entry) = coefficients(plant), state_and_input(plant)
    now, then = SIGNAL(TIMES), SIGNAL(TIMES + plant.sampling_time)
    np.testing.assert_array_equal(state((SIGNAL,), TIMES), now)
    np.testing.assert_allclose(entry((SIGNAL,), TIMES), (then - a * now - c) / b, atol=1e-13)
    assert (state.name, entry.name) == ("state", "input")
    for quantity, bounds in zip((state, entry), (plant.state_set, plant.input_set), strict=True):
        assert [interval for _, interval in bounds.intervals] == [quantity.bounds]


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


@given(plants, st.lists(st.floats(-3, 3), min_size=3, max_size=3), st.floats(-1, 3))
def test_tube_holds_the_next_state_exactly_where_the_input_is_admissible(plant, weights, time):
    signal = KernelSum(Matern52(1.0, 0.5), 0.1, np.array([0.0, 0.5, 1.5]), np.array(weights))
    reference, t = Reference((signal,), plant), np.array(time)
    low, high = reachable_tube(reference, t)
    following = reference.state_at(t + plant.sampling_time)[0]
    margin = interval_sets(plant)[1].margin(reference.input_at(t)[0])
    assume(abs(margin) > 1e-9)  # on the bound itself, rounding decides
    assert (low <= following <= high) == (margin > 0)


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


@pytest.mark.parametrize("seed", range(0, 16, 7))
def test_a_window_is_what_lies_ahead(seed):
    reference = general(seed)
    for k, horizon in ((0, 1), (5, 20), (2999, 3)):
        states, inputs = reference.window(k, horizon)
        assert (len(states), len(inputs)) == (horizon + 1, horizon)
        for i in range(horizon):
            np.testing.assert_allclose(states[i], reference.state(k + i), rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(inputs[i], reference.input(k + i), rtol=1e-12, atol=1e-11)
        np.testing.assert_allclose(states[-1], reference.state(k + horizon), rtol=1e-12, atol=1e-12)
