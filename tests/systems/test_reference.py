"""A reference's own states and inputs: the system, driven by them, goes where they say."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.gp.radial import Matern52
from pipeline.gp.signal import KernelSum
from pipeline.systems.interval import Interval
from pipeline.systems.quantity import Quantity
from pipeline.systems.reference import Reference
from tests.gp.instances import over
from tests.systems.instances import PLANTS, SIGNAL, plants

TIMES = np.linspace(-0.2, 2.0, 45)


@over(PLANTS, "plant")
def test_quantities_against_their_formulas(plant):
    a, b, c = plant.system.a, plant.system.b, plant.system.c
    now, then = SIGNAL(TIMES), SIGNAL(TIMES + plant.sampling_time)
    np.testing.assert_array_equal(plant.state(SIGNAL, TIMES), now)
    np.testing.assert_allclose(plant.input(SIGNAL, TIMES), (then - a * now - c) / b, atol=1e-13)
    assert (plant.state.name, plant.state.bounds) == ("state", plant.state_set)
    assert (plant.input.name, plant.input.bounds) == ("input", plant.input_set)


def test_a_quantity_is_a_weighted_sum_at_shifted_times():
    quantity = Quantity("anything", (2.0, 0.0, -3.0), 0.5, Interval(-1, 1), 0.1)
    expected = 0.5 + 2 * np.sin(TIMES) - 3 * np.sin(TIMES + 0.2)
    np.testing.assert_allclose(quantity(np.sin, TIMES), expected, rtol=1e-14)
    np.testing.assert_allclose(quantity.combine(np.cos, TIMES), 2 * np.cos(TIMES) - 3 * np.cos(TIMES + 0.2), rtol=1e-14)


def test_the_derivative_of_a_quantity_combines_the_derivative():
    plant, step = PLANTS["unstable"], 1e-6
    by_differences = (plant.input(SIGNAL, TIMES + step) - plant.input(SIGNAL, TIMES - step)) / (2 * step)
    np.testing.assert_allclose(plant.input.combine(SIGNAL.derivative, TIMES), by_differences, atol=1e-7)


def test_combining_keeps_leading_axes():
    def stacked(t):
        return np.stack([np.sin(t), np.cos(t), t])

    rows = PLANTS["pulls"].input.combine(stacked, TIMES)
    for row, f in zip(rows, (np.sin, np.cos, lambda t: t), strict=True):
        np.testing.assert_array_equal(row, PLANTS["pulls"].input.combine(f, TIMES))


@over(PLANTS, "plant")
@pytest.mark.parametrize("level", [-0.4, 0.0, 1.1])
def test_at_rest_a_quantity_is_that_of_a_constant_signal(plant, level):
    for quantity in (plant.state, plant.input):
        assert quantity.at_rest(level) == pytest.approx(
            float(quantity(lambda t: np.full_like(t, level), np.array(0.3))), abs=1e-13
        )
    assert plant.state.at_rest(level) == level
    assert plant.input.at_rest(level) == pytest.approx(plant.system.equilibrium_input(level), abs=1e-13)


@over(PLANTS, "plant")
def test_stepping_from_a_state_with_its_input_lands_on_the_next(plant):
    reference = Reference(SIGNAL, plant)
    landed = plant.system.successor(reference.state(TIMES), reference.input(TIMES))
    np.testing.assert_allclose(landed, reference.state(TIMES + plant.sampling_time), atol=1e-13)


def test_driving_the_system_by_the_inputs_reproduces_the_reference():
    plant = PLANTS["example1"]
    reference = Reference(SIGNAL, plant)
    times = reference.instants(np.arange(40))
    x, visited = float(reference.state(times)[0]), []
    for u in reference.input(times).tolist():
        visited.append(x)
        x = float(plant.system.successor(x, u))
    np.testing.assert_allclose(visited, reference.state(times), atol=1e-12)


@given(plants, st.lists(st.floats(-3, 3), min_size=3, max_size=3), st.floats(-1, 3))
def test_tube_holds_the_next_state_exactly_where_the_input_is_admissible(plant, weights, time):
    signal = KernelSum(Matern52(1.0, 0.5), 0.1, np.array([0.0, 0.5, 1.5]), np.array(weights))
    reference, t = Reference(signal, plant), np.array(time)
    low, high = reference.tube(t)
    following = reference.state(t + plant.sampling_time)
    margin = plant.input_set.margin(reference.input(t))
    if abs(margin) > 1e-9:
        assert (low <= following <= high) == (margin > 0)


def test_instants_and_quantities():
    reference = Reference(SIGNAL, PLANTS["example1"])
    np.testing.assert_allclose(reference.instants(np.array([0, 1, 30])), [0.0, 0.05, 1.5], rtol=1e-15)
    assert [q.name for q in reference.quantities] == ["state", "input"]
