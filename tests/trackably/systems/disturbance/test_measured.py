"""Measurement noise: a feedback that is given the measured state keeps the true one inside."""

from fractions import Fraction

import numpy as np
import pytest

from tests.trackably.systems.disturbance.instances import CART
from trackably.systems.disturbances import Zonotope, of_measured_state
from trackably.systems.tightening import tightening

PUSH, NOISE = Zonotope.box([0.0, -0.02], [0.0, 0.02]), Zonotope.box([-0.004, -0.006], [0.002, 0.01])
NOISY = of_measured_state(PUSH, NOISE, CART.system.A)


def test_the_disturbance_of_the_measured_state_is_what_noise_and_pushes_do_to_it():
    """h of W ⊕ (−A V) ⊕ V by its three parts."""
    rows = np.random.default_rng(0).normal(size=(20, 2))
    expected = PUSH.support(rows) + NOISE.support(-rows @ CART.system.A) + NOISE.support(rows)
    assert NOISY.support(rows) == pytest.approx(expected)
    row = [Fraction(3, 2), Fraction(-1)]
    assert float(NOISE.exact_support(row)) == pytest.approx(NOISE.support(np.array([1.5, -1.0])))


@pytest.mark.parametrize("corner", [(0.999, 0.0), (-0.999, 0.0), (0.0, 0.999), (0.0, -0.999)])
def test_the_true_state_and_the_input_keep_the_given_bounds(corner):
    """At a constant nominal state near a corner of what is left, with greedy pushes and noise for each row."""
    tightened = tightening(CART, PUSH, noise=NOISE)
    Z, left, system = tightened.invariant, tightened.plant.state_set, CART.system
    z = np.array([part * (left.upper[i] if part > 0 else -left.lower[i]) for i, part in enumerate(corner)])
    for aim in np.vstack([np.eye(2), -np.eye(2), Z.feedback, -Z.feedback]):
        v = np.zeros(2)
        e = np.zeros(2)  # of the measured state
        for k in range(60):
            w, following = PUSH.farthest(aim), NOISE.farthest(aim if k % 2 else -aim)
            e = Z.closed_loop @ e + w - system.A @ v + following
            v = following
            assert CART.state_set.margin(z + e - v) >= 0
            assert np.max(np.abs(Z.feedback @ e)) <= float(CART.input_set.upper[0] - tightened.plant.input_set.upper[0])


def test_bounds_of_states_are_drawn_in_by_the_noise_beside_the_errors():
    tightened = tightening(CART, PUSH, noise=NOISE)
    of_errors = tightening(CART, NOISY, tightened.invariant.feedback)
    assert of_errors.plant.state_set.upper - tightened.plant.state_set.upper == pytest.approx([0.004, 0.006])
    assert tightened.plant.state_set.lower - of_errors.plant.state_set.lower == pytest.approx([0.002, 0.01])
    assert np.array_equal(of_errors.plant.input_set.upper, tightened.plant.input_set.upper)
    assert (tightened.disturbance, tightened.noise) == (PUSH, NOISE)


def test_without_noise_nothing_changes():
    still, plain = tightening(CART, PUSH, noise=Zonotope([0.0, 0.0])), tightening(CART, PUSH)
    assert np.array_equal(plain.plant.state_set.upper, still.plant.state_set.upper)
    assert np.array_equal(plain.invariant.feedback, still.invariant.feedback)
