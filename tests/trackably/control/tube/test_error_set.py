"""The error set in float64, and its nearest points: against its definition, as convex programs have it."""

import cvxpy as cp
import numpy as np
import pytest

from tests.trackably.control.tube.instances import LOOPS, TWO_CARTS
from tests.trackably.control.tube.naive import in_error_set
from tests.trackably.systems.disturbance.instances import ALL
from trackably.control.tube import ErrorSet, Nearest
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.polytopes import Polytope
from trackably.systems.tightening import tightening


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
    for direction in np.random.default_rng(0).normal(size=(6, len(Z.box))):
        e = cp.Variable(len(Z.box))
        cp.Problem(cp.Maximize(direction @ e), in_error_set(Z, e)).solve(solver=cp.CLARABEL)
        assert direction @ e.value == pytest.approx(errors.support(direction[None])[0], rel=1e-3)
        middle = -0.5 * (errors.support(-np.eye(len(Z.box))) - errors.support(np.eye(len(Z.box))))
        assert errors.contains(middle + 0.99 * (e.value - middle))
        assert not errors.contains(middle + 1.01 * (e.value - middle))


@pytest.mark.parametrize("name", LOOPS)
def test_vertices_are_inside_and_what_is_hardly_beyond_them_is_not(name):
    errors = LOOPS[name].controller.errors
    for direction in np.random.default_rng(4).normal(size=(8, errors.dimension)) / errors.extents:
        vertex = errors.farthest(direction)
        assert errors.contains(vertex)
        assert not errors.contains(vertex + (1e-9 if errors.facets else 1e-7) * (vertex - errors.centre))


@pytest.mark.parametrize("unit", [1.0, 1e-5, 1e-10])
def test_each_coordinate_has_its_own_rounding(unit):
    """One of two carts moves in another unit: what rounding may miss of the other one does not count there."""
    sizes = np.array([1.0, 1.0, unit, unit])
    W = Zonotope.box(*(0.02 * sizes * [0, side, 0, side] for side in (-1, 1)))
    plant = ConstrainedSystem(
        TWO_CARTS.system, Polytope.box(-sizes, sizes), Polytope.box(-2 * sizes[[0, 2]], 2 * sizes[[0, 2]])
    )
    errors = ErrorSet(tightening(plant, W).invariant)
    for direction in np.random.default_rng(4).normal(size=(8, 2)):
        e = errors.farthest(np.array([0.0, 0.0, *direction])) * [0, 0, 1, 1]
        assert errors.contains((1 - 1e-9) * e)
        assert not errors.contains((1 + 1e-9) * e)


@pytest.mark.parametrize("name", LOOPS)
def test_disturbed_errors_stay_inside(name):
    loop = LOOPS[name]
    Z, errors, rng = loop.tightening.invariant, loop.controller.errors, np.random.default_rng(1)
    e = np.zeros(len(Z.box))
    for _ in range(40):
        e = Z.closed_loop @ e + Z.disturbance.farthest(rng.normal(size=len(e)))
        assert errors.contains(e)


def roots(errors: ErrorSet) -> list[np.ndarray]:
    """Distances in units of Z, one of which couples all coordinates."""
    n, rng = errors.dimension, np.random.default_rng(5)
    return [np.eye(n) / errors.extents, (np.eye(n) + 0.4 * rng.standard_normal((n, n))) / errors.extents]


@pytest.mark.parametrize("name", LOOPS)
def test_the_nearest_error_is_that_of_the_definition(name):
    loop, rng = LOOPS[name], np.random.default_rng(0)
    errors, Z = loop.controller.errors, loop.tightening.invariant
    for root in roots(errors):
        nearest = Nearest(errors, root)
        for part in (0.7, 3.0):
            e = part * errors.extents * rng.uniform(-1, 1, len(root))
            found, d = nearest(e), cp.Variable(len(e))
            program = cp.Problem(cp.Minimize(cp.sum_squares(root @ (e - d))), in_error_set(Z, d))
            program.solve(solver=cp.CLARABEL)
            assert np.sum((root @ (e - found)) ** 2) == pytest.approx(program.value, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("name", LOOPS)
@pytest.mark.parametrize("beyond", [1e-9, 1e-6, 1e-3, 0.3, 20.0])
def test_no_error_is_farther_in_the_direction_from_the_nearest_one(name, beyond):
    """The condition of optimality, with the support of Z: near the edge it holds up to rounding of the size of Z."""
    errors, rng = LOOPS[name].controller.errors, np.random.default_rng(1)
    for root in roots(errors):
        nearest, sizes = Nearest(errors, root), np.sum((root @ errors.extents) ** 2)
        for direction in rng.standard_normal((5, len(root))) / errors.extents:
            e = errors.farthest(direction) + beyond * errors.extents * rng.uniform(-1, 1, len(root))
            found = nearest(e)
            normal = root.T @ root @ (e - found)
            gap = errors.support(normal) - normal @ found
            assert gap <= 1e-9 * (normal @ (e - found)) + 1e-13 * sizes * (1 + beyond) ** 2
            assert errors.contains(found)
            assert nearest(found) is found
