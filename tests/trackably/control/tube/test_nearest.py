"""Nearest errors of Z against the convex program of its definition, and what proves them nearest."""

import cvxpy as cp
import numpy as np
import pytest

from tests.trackably.control.tube.instances import HULL, LOOPS
from tests.trackably.control.tube.naive import in_error_set
from trackably.control.error_set import Faces, Nearest, Polygon, nearest_in


def roots(loop) -> list[np.ndarray]:
    """Distances in units of Z, one of which couples all coordinates."""
    n, rng = len(loop.controller.Q), np.random.default_rng(5)
    units = loop.controller.errors.extents
    return [np.eye(n) / units, (np.eye(n) + 0.4 * rng.standard_normal((n, n))) / units]


@pytest.mark.parametrize("name", LOOPS)
def test_the_nearest_error_is_that_of_the_definition(name):
    loop, rng = LOOPS[name], np.random.default_rng(0)
    errors, Z = loop.controller.errors, loop.tightening.invariant
    for root in roots(loop):
        nearest = Nearest(errors, root)
        for part in (0.7, 3.0):
            e = part * errors.extents * rng.uniform(-1, 1, len(root))
            if errors.contains(e):
                continue
            found, d = nearest(e), cp.Variable(len(e))
            program = cp.Problem(cp.Minimize(cp.sum_squares(root @ (e - d))), in_error_set(Z, d))
            program.solve(solver=cp.CLARABEL)
            assert np.sum((root @ (e - found)) ** 2) == pytest.approx(program.value, rel=1e-6)
            assert errors.contains(found)


@pytest.mark.parametrize("name", LOOPS)
def test_no_error_is_farther_in_the_direction_from_the_nearest_one(name):
    """The condition of optimality, with the support of Z; and an error of Z is its own nearest one."""
    loop, rng = LOOPS[name], np.random.default_rng(1)
    errors = loop.controller.errors
    for root in roots(loop):
        nearest = Nearest(errors, root)
        for e in 2 * errors.extents * rng.uniform(-1, 1, (10, len(root))):
            found = nearest(e)
            normal = nearest.normal(e, found)
            assert errors.support(normal) - normal @ found <= 1e-8 * (1e-12 + normal @ (e - found))
            assert nearest(0.9 * found) == pytest.approx(0.9 * found, rel=1e-9, abs=1e-12)


def test_errors_that_leave_one_polygon_of_a_product_only():
    """From its middle to its edge in the other one, so that it is left, too, where the distance couples the two."""
    errors, rng = LOOPS["two carts"].controller.errors, np.random.default_rng(6)
    corners = errors.corners([0, 1])
    for root in roots(LOOPS["two carts"]):
        nearest = Nearest(errors, root)
        for part in rng.uniform(0, 1, 40):
            e = 2 * errors.extents * rng.choice([-1, 1], 4)
            e[:2] = part * rng.choice(corners)
            found = nearest(e)
            normal = nearest.normal(e, found)
            assert errors.support(normal) - normal @ found <= 1e-8 * (normal @ (e - found))
            assert errors.contains((1 - 1e-9) * found)


def test_faces_of_three_states_are_enough_and_agree_with_the_method_for_any_set():
    """Near the edges of Z and far from them: facets, edges and vertices are all met; and not one is overlooked."""
    loop, rng = LOOPS["three states"], np.random.default_rng(4)
    errors = loop.controller.errors
    for root in roots(loop):
        nearest, faces = Nearest(errors, root), Faces.of(errors, root)
        for e in rng.choice([0.6, 2.0], 40)[:, None] * errors.extents * rng.uniform(-1, 1, (40, 3)):
            found = faces.nearest(e)
            assert (found is e) == errors.contains(e)
            assert nearest(e) is e or nearest._is_nearest(e, found)
            assert found == pytest.approx(nearest._combined(e), abs=1e-6 * np.max(errors.extents))
    assert Faces.of(LOOPS["three states, a hull"].controller.errors, np.eye(3)) is None


def test_points_of_faces_are_errors_of_the_set_where_generators_are_nearly_parallel():
    """As powers of A_K turn them into one direction: no face may hold one of them twice."""
    errors, rng = LOOPS["another"].controller.errors, np.random.default_rng(7)
    for root in roots(LOOPS["another"]):
        faces = Faces.of(errors, root)
        for e in 2 * errors.extents * rng.uniform(-1, 1, (20, 3)):
            assert errors.contains((1 - 1e-9) * faces.nearest(e)) or errors.contains(e)


def test_edges_and_corners_of_polygons_are_the_nearest_of_all():
    """In the plane, beside a product's other coordinates, and of intervals; beside a naive search over all edges."""
    for name, block in (("pushed cart", [0, 1]), ("two carts", [2, 3]), ("two carts", [1])):
        errors, rng = LOOPS[name].controller.errors, np.random.default_rng(2)
        for root in roots(LOOPS[name]):
            polygon = Polygon(errors, block, root)
            corners = errors.corners(block)
            steps = np.linspace(0, 1, 2001)[:, None, None]
            points = (corners + steps * (np.roll(corners, -1, axis=0) - corners)).reshape(-1, len(block))
            for e in 3 * errors.extents * rng.uniform(-1, 1, (20, len(root))):
                found, offs = polygon.nearest(e, e), np.zeros((len(points), len(root)))
                if polygon.contains(e[block]):
                    assert found == pytest.approx(e[block])
                    continue
                offs[:, block] = points - e[block]
                off = np.zeros(len(root))
                off[block] = found - e[block]
                assert np.linalg.norm(root @ off) == pytest.approx(
                    np.linalg.norm(offs @ root.T, axis=1).min(), rel=1e-5
                )


def test_products_of_polygons_are_seen_as_such():
    for name, blocks in (("two carts", [[0, 1], [2, 3]]), ("three states", [[0, 1, 2]])):
        assert [block.tolist() for block in LOOPS[name].controller.errors.blocks] == blocks
    assert LOOPS["three states, a hull"].controller.errors.halfspaces is None
    assert isinstance(LOOPS["three states, a hull"].disturbance, type(HULL))


def test_half_spaces_of_a_product_hold_the_points_that_its_parts_add_up_to():
    errors, rng = LOOPS["two carts"].controller.errors, np.random.default_rng(3)
    points = 0.6 * errors.extents * rng.uniform(-1, 1, (60, 4))
    inside = [errors.contains(e) for e in points]
    assert inside == [errors._weights(e) is not None for e in points]
    assert 3 < sum(inside) < 57


@pytest.mark.parametrize("seed", range(12))
def test_the_nearest_point_of_a_polyhedron_is_that_of_a_convex_program(seed):
    rng = np.random.default_rng(seed)
    rows, aim = rng.standard_normal((12, 5)), rng.standard_normal(5)
    limits = rows @ rng.standard_normal(5) + rng.uniform(0, 0.3, 12)
    q = cp.Variable(5)
    program = cp.Problem(cp.Minimize(cp.sum_squares(q - aim)), [rows @ q <= limits])
    program.solve(solver=cp.CLARABEL)
    found = nearest_in(rows, limits, aim)
    assert np.max(rows @ found - limits) <= 1e-9
    assert np.sum((found - aim) ** 2) == pytest.approx(program.value, rel=1e-6, abs=1e-12)


def test_a_polyhedron_without_points_has_no_nearest_one():
    assert nearest_in(np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([-1.0, 0.5]), np.zeros(2)) is None
