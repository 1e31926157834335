"""The error set in float64: half-spaces and generators describe the same Z."""

import cvxpy as cp
import numpy as np
import pytest

from tests.trackable.control.tube.instances import LOOPS
from tests.trackable.control.tube.naive import in_error_set
from tests.trackable.systems.disturbance.instances import ALL
from trackable.control.tube.error_set import ErrorSet


@pytest.mark.parametrize("name", ALL)
def test_the_support_is_the_exact_one(name):
    Z = ALL[name].tightening.invariant
    for axis in np.eye(len(Z.box)):
        exact = float(Z.support([*map(int, axis)]))
        assert ErrorSet(Z).support(axis[None])[0] == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("name", LOOPS)
def test_points_of_the_set_are_inside_and_others_are_not(name):
    """Points on the boundary by a convex program of the definition, moved in and out by a hundredth."""
    loop = LOOPS[name]
    Z, errors = loop.tightening.invariant, loop.controller.errors
    rng = np.random.default_rng(0)
    for direction in rng.normal(size=(6, len(Z.box))):
        e = cp.Variable(len(Z.box))
        cp.Problem(cp.Maximize(direction @ e), in_error_set(Z, e)).solve(solver=cp.CLARABEL)
        assert direction @ e.value == pytest.approx(errors.support(direction[None])[0], rel=1e-3)
        middle = -0.5 * (errors.support(-np.eye(len(Z.box))) - errors.support(np.eye(len(Z.box))))
        assert errors.contains(middle + 0.99 * (e.value - middle))
        assert not errors.contains(middle + 1.01 * (e.value - middle))


def test_facets_and_programs_agree():
    """Three states have both: the sides that generators span, and a program for their weights."""
    errors = LOOPS["three states"].controller.errors
    rng = np.random.default_rng(2)
    sides = errors.support(np.vstack([np.eye(3), -np.eye(3)]))
    points = rng.uniform(-sides[3:], sides[:3], (40, 3))
    inside = [errors.contains(e) for e in points]
    assert inside == [errors._weights(e) is not None for e in points]
    assert 3 < sum(inside) < 37


@pytest.mark.parametrize("name", LOOPS)
def test_disturbed_errors_stay_inside(name):
    loop = LOOPS[name]
    Z, errors, rng = loop.tightening.invariant, loop.controller.errors, np.random.default_rng(1)
    e = np.zeros(len(Z.box))
    for _ in range(40):
        e = Z.closed_loop @ e + Z.disturbance.farthest(rng.normal(size=len(e)))
        assert errors.contains(e)
