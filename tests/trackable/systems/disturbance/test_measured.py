"""Measurement noise: a feedback that is given the measured state keeps the true one inside."""

import numpy as np
import pytest

from tests.trackable.systems.disturbance.instances import CART
from trackable.systems.disturbance.measured import measured
from trackable.systems.disturbance.tightening import tightening
from trackable.systems.disturbance.zonotope import Zonotope

PUSH, NOISE = Zonotope.box([0.0, -0.02], [0.0, 0.02]), Zonotope.box([-0.004, -0.006], [0.002, 0.01])


def test_the_disturbance_of_the_measured_state_is_what_noise_and_pushes_do_to_it():
    """h of W ⊕ (−A V) ⊕ V by its three parts."""
    _, found = measured(CART, PUSH, NOISE)
    rows = np.random.default_rng(0).normal(size=(20, 2))
    expected = PUSH.support(rows) + NOISE.support(-rows @ CART.system.A) + NOISE.support(rows)
    assert found.support(rows) == pytest.approx(expected)


@pytest.mark.parametrize("corner", [(0.999, 0.0), (-0.999, 0.0), (0.0, 0.999), (0.0, -0.999)])
def test_the_true_state_and_the_input_keep_the_given_bounds(corner):
    """At a constant nominal state near a corner of what is left, with greedy pushes and noise for each row."""
    inner, disturbance = measured(CART, PUSH, NOISE)
    drawn_in = tightening(inner, disturbance)
    Z, left, system = drawn_in.invariant, drawn_in.plant.state_set, CART.system
    z = np.array([part * (left.upper[i] if part > 0 else -left.lower[i]) for i, part in enumerate(corner)])
    for aim in np.vstack([np.eye(2), -np.eye(2), Z.feedback, -Z.feedback]):
        v = np.zeros(2)
        e = np.zeros(2)  # of the measured state
        for k in range(60):
            w, following = PUSH.farthest(aim), NOISE.farthest(aim if k % 2 else -aim)
            e = Z.closed_loop @ e + w - system.A @ v + following
            v = following
            assert CART.state_set.margin(z + e - v) >= 0
            assert np.max(np.abs(Z.feedback @ e)) <= float(CART.input_set.upper[0] - drawn_in.plant.input_set.upper[0])


def test_without_noise_nothing_changes():
    plant, disturbance = measured(CART, PUSH, Zonotope.box([0.0, 0.0], [0.0, 0.0]))
    assert np.array_equal(plant.state_set.upper, CART.state_set.upper)
    assert disturbance.support(np.eye(2)).tolist() == PUSH.support(np.eye(2)).tolist()


def test_noise_that_leaves_nothing_is_refused():
    with pytest.raises(ValueError, match="interior"):
        measured(CART, PUSH, Zonotope.box([-1.5, 0.0], [1.5, 0.0]))
