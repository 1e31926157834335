"""Scalar linear systems: the dynamics and their inverse, successor sets, growth rates."""

import numpy as np
import pytest
from hypothesis import given

from pipeline.published.scalar import (
    coefficients,
    equilibrium_input,
    growth_rates,
    interval_sets,
    successor_set,
)
from tests.trackably.gp.instances import over
from tests.trackably.systems.instances import PLANTS, intervals, plants

STATES = np.linspace(-3, 3, 13)


@over(PLANTS, "plant")
def test_successor_set_is_what_the_inputs_reach_and_one_input_holds_each_state(plant):
    for x in STATES.tolist():
        assert plant.system.successor([x], [equilibrium_input(plant, x)]).item() == pytest.approx(x, abs=1e-13)
    low, high = successor_set(plant, STATES)
    (a, b, c), (_, input_set) = coefficients(plant), interval_sets(plant)
    reached = a * STATES[:, None] + b * np.linspace(input_set.lower, input_set.upper, 101) + c
    np.testing.assert_allclose(low, reached.min(axis=1), atol=1e-14)
    np.testing.assert_allclose(high, reached.max(axis=1), atol=1e-14)
    assert np.all(low < high)


@given(plants, intervals())
def test_growth_rates_stay_in_every_successor_set_and_are_the_largest_that_do(plant, states):
    tau_low, tau_high = growth_rates(plant, states)
    x = np.linspace(states.lower, states.upper, 200)
    low, high = successor_set(plant, x)
    t_s, rounding = plant.sampling_time, 1e-12 * (1 + np.max(np.abs([low, high])) + np.max(np.abs(x)))
    assert np.all(x + tau_low * t_s >= low - rounding)
    assert np.all(x + tau_high * t_s <= high + rounding)
    assert np.min(x + tau_low * t_s - low) <= rounding  # somewhere it touches
    assert np.min(high - x - tau_high * t_s) <= rounding
