"""Tightened sets: what is left, what is short, what would do, and what noise of the measured state adds."""

import re
from fractions import Fraction

import numpy as np
import pytest

from tests.trackably.systems.disturbance.instances import CART, DISTURBED, OBLIQUE, scaled
from tests.trackably.systems.nonlinear_instances import INSTANCES
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import ConvexHull, Zonotope, disturbances_of_errors
from trackably.systems.polytopes import Polytope
from trackably.systems.tightening import tightening


@pytest.mark.parametrize(("name", "margin"), [("example1", 0.0), ("pushed", 0.2), ("oblique", 0.2), ("triangle", 0.0)])
def test_the_largest_fraction_is_the_largest(name, margin):
    """A little less leaves something, a little more leaves nothing; for the same feedback."""
    given = DISTURBED[name]
    found = tightening(given.plant, given.disturbance, margin=margin)
    K, size = found.invariant.feedback, Fraction(found.largest_fraction)
    less, more = (scaled(given.disturbance, size * Fraction(part)) for part in (0.95, 1.05))
    kept, same = tightening(given.plant, less, K, margin).plant, found.plant_for(0.95 * found.largest_fraction)
    for one, other in ((kept.state_set, same.state_set), (kept.input_set, same.input_set)):
        np.testing.assert_allclose([one.lower, one.upper], [other.lower, other.upper], rtol=1e-6)
    with pytest.raises(ValueError, match=r"with this feedback .* at most 0\.9\d* times this disturbance set is"):
        tightening(given.plant, more, K, margin)
    with pytest.raises(ValueError, match=r"times this disturbance set is"):
        found.plant_for(1.05 * found.largest_fraction)


def test_bounds_that_leave_nothing_together_are_said_to():
    """Each row of a thin triangle alone has room left, but no point keeps all three."""
    triangle = Polytope([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], [0.0, 0.0, -9.0], [1.0, 1.0, 0.1])
    plant = ConstrainedSystem(OBLIQUE.system, triangle, OBLIQUE.input_set)
    with pytest.raises(ValueError, match="satisfies all bounds at once") as caught:
        tightening(plant, Zonotope.box([-0.02, -0.02], [0.02, 0.02]))
    fraction = float(re.search(r"feedback= takes another\) at most (\S+) times", str(caught.value)).group(1))
    assert 0 < fraction < 1


def test_the_feedback_does_not_depend_on_units():
    """The same plant in millimetres has the same feedback, of the error in millimetres."""
    system, unit = CART.system, np.array([1000.0, 1.0])
    scaled = ConstrainedSystem(
        type(system)(system.A * unit[:, None] / unit, system.B * unit[:, None], sampling_time=0.1),
        Polytope.box(-unit, unit),
        CART.input_set,
    )
    K, K_scaled = (
        tightening(plant, Zonotope.box(-0.01 * by, 0.01 * by)).invariant.feedback
        for plant, by in ((CART, np.ones(2)), (scaled, unit))
    )
    assert K_scaled * unit == pytest.approx(K, rel=1e-4)


PUSH, NOISE = Zonotope.box([0.0, -0.02], [0.0, 0.02]), Zonotope.box([-0.004, -0.006], [0.002, 0.01])
NOISY = disturbances_of_errors(CART, PUSH, NOISE, None)


def test_the_disturbance_of_the_measured_state_is_what_noise_and_pushes_do_to_it():
    """h of W ⊕ (−A V) ⊕ V by its three parts."""
    rows = np.random.default_rng(0).normal(size=(20, 2))
    expected = PUSH.support(rows) + NOISE.support(-rows @ CART.system.A) + NOISE.support(rows)
    assert NOISY.support(rows) == pytest.approx(expected)


def test_bounds_of_states_are_drawn_in_by_the_noise_beside_the_errors():
    tightened = tightening(CART, PUSH, noise=NOISE)
    of_errors = tightening(CART, NOISY, tightened.invariant.feedback)
    assert of_errors.plant.state_set.upper - tightened.plant.state_set.upper == pytest.approx([0.004, 0.006])
    assert tightened.plant.state_set.lower - of_errors.plant.state_set.lower == pytest.approx([0.002, 0.01])
    assert np.array_equal(of_errors.plant.input_set.upper, tightened.plant.input_set.upper)
    assert (tightened.disturbance, tightened.noise) == (PUSH, NOISE)


REFUSED = {
    "a feedback alone": (OBLIQUE, None, "is only of use with a disturbance, measurement_noise or model_error"),
    "formulas": (INSTANCES["tank"].plant, Zonotope.box([-0.1], [0.1]), "disturbance: .* linear .* give margin="),
    "errors that grow": (CART, PUSH, r"inside the unit circle, but one has the size 1\.1"),
    "a box beside zero": (CART, Zonotope.box([0.0, 0.1], [0.0, 0.2]), "must contain 0"),
    "a hull beside zero": (CART, ConvexHull([[1.0, 0.0], [0.0, 1.0]]), "must contain 0"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_has_no_tightened_bounds_is_refused(name):
    plant, disturbance, said = REFUSED[name]
    with pytest.raises(ValueError, match=said):
        tightening(plant, disturbance, [[1.0, 1.0]])
