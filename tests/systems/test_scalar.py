"""Scalar linear systems: the dynamics and their inverse, successor sets, growth rates."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.systems.interval import Interval
from pipeline.systems.scalar import ConstrainedSystem, ScalarLinear
from tests.gp.instances import over
from tests.systems.instances import PLANTS, SYSTEMS, intervals, plants

STATES = np.linspace(-3, 3, 13)


@pytest.mark.parametrize(
    "abc", [(0.9, 0.0, 0.0), (math.nan, 1.0, 0.0), (0.9, math.inf, 0.0), (0.9, math.nan, 0.0), (0.9, 1.0, -math.inf)]
)
def test_impossible_systems_are_refused(abc):
    a, b, c = abc
    with pytest.raises(ValueError, match=f"^system: a, b, c must be finite and b ≠ 0, got a={a}, b={b}, c={c}$"):
        ScalarLinear(a, b, c)


@pytest.mark.parametrize("bad", [0.0, -0.01, math.nan, math.inf])
def test_impossible_sampling_times_are_refused(bad):
    with pytest.raises(ValueError, match=f"^system: sampling_time must be a positive finite number, got {bad!r}$"):
        ConstrainedSystem(SYSTEMS["example1"], Interval(-1, 1), Interval(-1, 1), bad)


@pytest.mark.parametrize("name", ["state_set", "input_set"])
def test_sets_need_an_interior(name):
    sets = {"state_set": Interval(-1.0, 1.0), "input_set": Interval(-1.0, 1.0)} | {name: Interval(0.5, 0.5)}
    with pytest.raises(ValueError, match=rf"^system: {name} must have an interior, got \[0\.5, 0\.5\]$"):
        ConstrainedSystem(SYSTEMS["example1"], sampling_time=0.1, **sets)


def test_dynamics_in_numbers():
    system = ScalarLinear(0.9, 0.5, 0.1)
    np.testing.assert_allclose(system.successor(np.array([1.0, 2.0]), np.array([0.5, -1.0])), [1.25, 1.4], rtol=1e-15)


@over(SYSTEMS, "system")
def test_input_and_successor_are_inverse(system):
    inputs = np.linspace(-2, 2, 13)
    np.testing.assert_allclose(system.input(STATES, system.successor(STATES, inputs)), inputs, atol=1e-13)
    np.testing.assert_allclose(system.successor(STATES, system.input(STATES, inputs)), inputs, atol=1e-13)


@over(SYSTEMS, "system")
def test_equilibrium_input_holds_the_state(system):
    for x in STATES.tolist():
        assert system.successor(x, system.equilibrium_input(x)) == pytest.approx(x, abs=1e-13)


@over(PLANTS, "plant")
def test_successor_set_is_what_the_inputs_reach(plant):
    low, high = plant.successor_set(STATES)
    inputs = np.linspace(plant.input_set.lower, plant.input_set.upper, 101)
    reached = plant.system.successor(STATES[:, None], inputs)
    np.testing.assert_allclose(low, reached.min(axis=1), atol=1e-14)
    np.testing.assert_allclose(high, reached.max(axis=1), atol=1e-14)
    assert np.all(low < high)


def test_successor_set_in_numbers():
    for sign in (1, -1):
        plant = ConstrainedSystem(ScalarLinear(0.9, sign * 0.5), Interval(-2, 2), Interval(-0.2, 0.4), 0.01)
        low, high = plant.successor_set(np.array([1.0]))
        np.testing.assert_allclose([low[0], high[0]], [0.8, 1.1] if sign > 0 else [0.7, 1.0], rtol=1e-15)


def test_successor_set_of_whole_numbers():
    plant = PLANTS["example1"]
    for one, other in zip(
        plant.successor_set(np.array([0, 1])), plant.successor_set(np.array([0.0, 1.0])), strict=True
    ):
        np.testing.assert_array_equal(one, other)


@given(plants, intervals())
def test_growth_rates_stay_in_every_successor_set_and_are_the_largest_that_do(plant, states):
    tau_low, tau_high = plant.growth_rates(states)
    x = np.linspace(states.lower, states.upper, 200)
    low, high = plant.successor_set(x)
    t_s, rounding = plant.sampling_time, 1e-12 * (1 + np.max(np.abs([low, high])) + np.max(np.abs(x)))
    for rate in (tau_low, tau_high):
        if tau_low <= tau_high:
            assert np.all(x + rate * t_s >= low - rounding)
            assert np.all(x + rate * t_s <= high + rounding)
    assert np.min(x + tau_low * t_s - low) <= rounding  # somewhere it touches
    assert np.min(high - x - tau_high * t_s) <= rounding


@given(plants, intervals())
def test_every_rate_beyond_leaves_some_successor_set(plant, states):
    tau_low, tau_high = plant.growth_rates(states)
    ends = np.array([states.lower, states.upper])
    low, high = plant.successor_set(ends)
    beyond = 1e-6 / plant.sampling_time
    assert np.any(ends + (tau_low - beyond) * plant.sampling_time < low)
    assert np.any(ends + (tau_high + beyond) * plant.sampling_time > high)


def test_growth_rates_in_numbers():
    """x⁺ = 0.9 x + 0.5 u on [−0.1, 0.2], |u| ≤ 0.5: 0.25 − 0.1·0.2 up, 0.25 − 0.1·0.1 down, in 0.01 s."""
    plant = ConstrainedSystem(ScalarLinear(0.9, 0.5), Interval(-2, 0.05), Interval(-0.5, 0.5), 0.01)
    assert plant.growth_rates(Interval(-0.1, 0.2)) == pytest.approx((-24.0, 23.0), rel=1e-13)


def test_without_a_common_rate_the_bounds_cross():
    plant = ConstrainedSystem(ScalarLinear(-1.0, 0.1), Interval(-2, 2), Interval(-1, 1), 0.5)
    tau_low, tau_high = plant.growth_rates(Interval(-1.0, 1.0))
    assert tau_low > tau_high


@over(PLANTS, "plant")
@pytest.mark.parametrize("x", [-0.3, 0.0, 1.2])
def test_growth_rates_of_one_state_are_its_successor_set(plant, x):
    rates = np.array(plant.growth_rates(Interval(x, x)))
    low, high = plant.successor_set(np.array(x))
    np.testing.assert_allclose(x + rates * plant.sampling_time, [low, high], rtol=1e-12)


@given(plants, st.floats(-3, 3), st.floats(-20, 20))
def test_tube_holds_the_next_state_where_the_input_is_admissible(plant, x, u):
    successor = plant.system.successor(np.array(x), np.array(u))
    low, high = plant.successor_set(np.array(x))
    margin = plant.input_set.margin(plant.system.input(np.array(x), successor))
    if abs(margin) > 1e-9:  # on the bound itself, rounding decides
        assert (low <= successor <= high) == (margin > 0)
