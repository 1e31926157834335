"""Tightened sets against brute force; what is left, what is short, and what would do."""

import re
from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from tests.trackably.systems.disturbance.instances import ALL, CART, DISTURBED, OBLIQUE
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.tightening import (
    INPUT_WEIGHTS,
    RATES,
    best_feedback,
    closed_loop,
    regulator,
    room,
    spectral_radius,
    tightening,
)


@pytest.mark.parametrize("name", ALL)
def test_tightened_bounds_leave_the_exact_support(name):
    found = ALL[name].tightening
    for before, after, (low, high) in zip(
        found.given.given_constraints, found.plant.given_constraints, found.taken, strict=True
    ):
        assert before.row == after.row
        assert Fraction(after.bounds.upper) + high <= Fraction(before.bounds.upper)
        assert Fraction(after.bounds.lower) - low >= Fraction(before.bounds.lower)
        assert after.bounds.upper + float(high) == pytest.approx(before.bounds.upper, rel=1e-14)


def test_without_disturbance_bounds_stay_to_the_last_bit():
    found = tightening(CART, Zonotope.box([0.0, 0.0], [0.0, 0.0])).plant
    for after, before in ((found.state_set, CART.state_set), (found.input_set, CART.input_set)):
        assert np.array_equal(after.lower, before.lower)
        assert np.array_equal(after.upper, before.upper)


@pytest.mark.parametrize("name", ["example1", "pushed", "oblique", "triangle"])
@pytest.mark.parametrize("margin", [0.0, 0.2])
def test_the_largest_fraction_is_the_largest(name, margin):
    """A little less leaves something, a little more leaves nothing; for the same feedback."""
    given = DISTURBED[name]
    found = tightening(given.plant, given.disturbance, margin=margin)
    K, size = found.invariant.feedback, Fraction(found.largest_fraction)
    less, more = (given.disturbance.scaled(size * Fraction(part)) for part in (0.95, 1.05))
    tightening(given.plant, less, K, margin)
    with pytest.raises(ValueError, match=r"0\.9\d* of this disturbance set would do"):
        tightening(given.plant, more, K, margin)


def test_bounds_that_leave_nothing_together_are_said_to():
    """Each row alone has room left, but no point keeps all three."""
    plant = ConstrainedSystem(OBLIQUE.system, _thin_triangle(), OBLIQUE.input_set)
    with pytest.raises(ValueError, match="all of the bounds together") as caught:
        tightening(plant, Zonotope.box([-0.02, -0.02], [0.02, 0.02]))
    fraction = float(re.search(r"with this feedback (\S+) of", str(caught.value)).group(1))
    assert 0 < fraction < 1


@pytest.mark.parametrize("name", ["example1", "pushed", "oblique"])
def test_the_feedback_leaves_nearly_the_most_room_and_forgets_errors_fastest(name):
    given = DISTURBED[name]
    plant = given.plant
    K = best_feedback(plant, given.disturbance)
    others = [regulator(plant, weight, rate) for weight, rate in product(INPUT_WEIGHTS, RATES)]
    rooms = [room(plant, given.disturbance, other) for other in others]
    left, radius = room(plant, given.disturbance, K), spectral_radius(closed_loop(plant.system, K))
    assert left >= max(rooms) - 0.05 > min(rooms)
    for other, of_other in zip(others, rooms, strict=True):
        assert of_other < max(rooms) - 0.05 or spectral_radius(closed_loop(plant.system, other)) >= radius


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


def test_nonlinear_systems_are_refused():
    plant = ConstrainedSystem(
        NonlinearSystem.of(lambda x, u: [x[0] + 0.1 * u[0]], ("x",), ("u",), 0.1),
        Polytope.box([-1.0], [1.0]),
        Polytope.box([-1.0], [1.0]),
    )
    with pytest.raises(ValueError, match="must be linear"):
        tightening(plant, Zonotope.box([-0.1], [0.1]))


def _thin_triangle() -> Polytope:
    """0 ≤ v ≤ 1 and 0 ≤ p, with p + v ≤ 0.1: far rows leave little where they meet."""
    return Polytope([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], [0.0, 0.0, -9.0], [1.0, 1.0, 0.1])
