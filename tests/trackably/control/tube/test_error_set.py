"""The error set in float64: against its definition, as convex programs have it."""

import cvxpy as cp
import numpy as np
import pytest

from tests.trackably.control.naive import in_error_set
from tests.trackably.control.tube.instances import LOOPS, TWO_CARTS
from trackably.control.error_set import ErrorSet
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.polytopes import Polytope
from trackably.systems.tightening import tightening


def farthest(errors: ErrorSet, row: np.ndarray) -> np.ndarray:
    """Return a vertex of Z, a zonotope, at which row · e is largest."""
    return errors.centre + np.where(errors.directions @ row >= 0, 1.0, -1.0) @ errors.directions


@pytest.mark.parametrize("name", LOOPS)
def test_points_of_the_set_are_inside_and_others_are_not(name):
    """Points on the boundary by a convex program of the definition, moved in and out by a hundredth."""
    loop = LOOPS[name]
    Z, errors = loop.tightening.invariant, loop.controller.errors
    middle = 0.5 * (errors.support(np.eye(len(Z.box))) - errors.support(-np.eye(len(Z.box))))
    e, row = cp.Variable(len(Z.box)), cp.Parameter(len(Z.box))
    farthest_point = cp.Problem(cp.Maximize(row @ e), in_error_set(Z, e))
    for direction in np.random.default_rng(0).normal(size=(6, len(Z.box))):
        row.value = direction
        farthest_point.solve(solver=cp.CLARABEL)
        assert direction @ e.value == pytest.approx(errors.support(direction[None])[0], rel=1e-3)
        assert errors.contains(middle + 0.99 * (e.value - middle))
        assert not errors.contains(middle + 1.01 * (e.value - middle))


@pytest.mark.parametrize("unit", [1.0, 1e-5, 1e-10])
def test_each_coordinate_has_its_own_rounding(unit):
    """One of two carts moves in another unit: what rounding may miss of the other one does not count there."""
    sizes = np.array([1.0, 1.0, unit, unit])
    W = Zonotope.box(*(0.02 * sizes * [0, side, 0, side] for side in (-1, 1)))
    plant = ConstrainedSystem(
        TWO_CARTS.system, Polytope.box(-sizes, sizes), Polytope.box(-2 * sizes[[0, 2]], 2 * sizes[[0, 2]])
    )
    errors = ErrorSet.of(tightening(plant, W).invariant)
    for direction in np.random.default_rng(4).normal(size=(8, 2)):
        e = farthest(errors, np.array([0.0, 0.0, *direction])) * [0, 0, 1, 1]
        assert errors.contains((1 - 1e-9) * e)
        assert not errors.contains((1 + 1e-9) * e)


def test_points_beside_a_flat_set_are_outside():
    flat = ErrorSet(np.zeros(2), np.array([[1.0, 0.0]]), -np.ones(1), np.zeros((0, 1)))
    assert flat.contains(np.array([0.5, 0.0]))
    assert not flat.contains(np.array([0.5, 0.1]))
