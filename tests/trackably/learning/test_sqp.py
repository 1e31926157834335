"""The nonlinear programs behind the learning, on problems whose answers are known."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls, rosen, rosen_der

from tests.trackably.gp.instances import over
from trackably.arrays import Array, Flags
from trackably.learning.sqp import Evaluation, QuadraticProgram, minimise

WIDE = np.full(2, -50.0), np.full(2, 50.0)


def unconstrained(value: float, gradient: Array) -> Evaluation:
    return Evaluation(value, gradient, np.empty(0), np.empty((0, len(gradient))))


def in_disc(x: Array) -> Evaluation:
    """Rosenbrock's valley inside the unit disc: the minimum lies on the circle."""
    return Evaluation(rosen(x), rosen_der(x), np.array([1 - x @ x]), -2 * x[None])


def on_curve(x: Array) -> Evaluation:
    """Powell's example of the Maratos effect: 2(x² + y² − 1) − x on the unit circle, seen as two inequalities."""
    circle = x @ x - 1
    value, gradient = 2 * circle - x[0], 4 * x - np.array([1.0, 0.0])
    return Evaluation(value, gradient, np.array([circle, -circle]), np.stack([2 * x, -2 * x]))


def parallel(x: Array) -> Evaluation:
    """Two hundred nearly parallel constraints, as a fine grid of times gives: y ≥ sin(x + h) for many small h."""
    off, shifted = x - np.array([1.0, 0.0]), x[0] + np.linspace(-0.01, 0.01, 200)
    jacobian = np.column_stack([-np.cos(shifted), np.ones(200)])
    return Evaluation(float(off @ off), 2 * off, x[1] - np.sin(shifted), jacobian)


FAR = (-1.2, 1.0), (0.0, 0.0), (2.0, -2.0), (10.0, 10.0)
KNOWN = {
    "Rosenbrock's valley": (lambda x: unconstrained(rosen(x), rosen_der(x)), [1, 1], 1e-6, FAR),
    "the valley in a disc": (in_disc, [0.7864151509, 0.6176983165], 1e-7, (*FAR[:2], (3.0, -3.0), (0.9, 0.9))),
    "nearly parallel constraints": (
        parallel,
        [0.5499650201, 0.5311565607],
        1e-6,
        ((0.0, 0.0), (1.0, 1.0), (-4.0, 3.0), (2.0, -5.0)),
    ),
    "a curved equality": (on_curve, [1, 0], 1e-6, ((0.8, 0.6), (0.0, 2.0), (-0.3, -1.5), (5.0, 1.0))),
}


@over(KNOWN, "at", "minimum", "within", "starts")
def test_known_minima_are_found_from_every_start(at, minimum, within, starts) -> None:
    for start, curvature in product(starts, (None, -np.eye(2))):  # rounding may leave no positive definite one
        found = minimise(at, np.array(start), *WIDE, curvature=curvature)
        assert found.converged
        assert found.x == pytest.approx(minimum, abs=within)
        assert found.at.violation < 1e-11


def test_where_the_trust_region_collapses_nothing_has_converged() -> None:
    """Every model promises a lower value to the right of 0, and every value there is larger."""
    found = minimise(lambda x: unconstrained(float(np.abs(x).sum()), np.array([-1.0, -1.0])), np.zeros(2), *WIDE)
    assert not found.converged


def test_points_without_a_value_are_not_entered() -> None:
    def at(x: Array) -> Evaluation | None:
        return None if x[0] < 0.5 else unconstrained(float(x @ x), 2 * x)

    assert minimise(at, np.zeros(2), *WIDE) is None
    assert 0.5 <= minimise(at, np.array([3.0, 3.0]), *WIDE).x[0] < 0.6


@given(st.integers(0, 10_000))
def test_linear_programs_with_curvature_against_their_conditions(seed: int) -> None:
    """A strictly convex quadratic program: at the answer the gradient is a non-negative sum of active normals."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3, 3))
    hessian, linear = root @ root.T + 0.1 * np.eye(3), rng.standard_normal(3)
    normals, offsets = rng.standard_normal((8, 3)), rng.uniform(0.1, 1, 8)  # the origin is feasible

    def at(x: Array) -> Evaluation:
        return Evaluation(float(x @ hessian @ x / 2 + linear @ x), hessian @ x + linear, normals @ x + offsets, normals)

    found = minimise(at, rng.uniform(-5, 5, 3), np.full(3, -50.0), np.full(3, 50.0))
    assert found.at.violation < 1e-10
    active = normals[found.at.slack < 1e-6]
    missed = nnls(active.T, found.at.gradient)[1] if len(active) else np.linalg.norm(found.at.gradient)
    assert missed < 1e-4


@given(st.integers(0, 10_000), st.sampled_from([1e-2, 1.0, 1e2, 1e9]))
def test_a_step_is_the_same_whatever_rows_were_assumed_active_and_its_multipliers_bound_the_least_violation(
    seed: int, penalty: float
) -> None:
    """The penalties let few and many rows be active; with the largest, the step has the least violation of the box."""
    rng = np.random.default_rng(seed)
    root, jacobian, slack = rng.standard_normal((4, 4)), rng.standard_normal((12, 4)), rng.uniform(-0.5, 1, 12)
    gradient, end = 3 * rng.standard_normal(4), np.full(4, rng.uniform(0.01, 1))

    def solved(active: Flags) -> tuple[Array, float]:
        flags = np.array([active, active])
        program = QuadraticProgram.of(root @ root.T + 0.1 * np.eye(4), gradient, jacobian, -end, end, flags)
        step, multipliers = program.solve(slack, penalty)
        return step, program.least_violation(slack, multipliers)

    step, _ = solved(np.ones(21, dtype=bool))
    steps = np.vstack([step, rng.uniform(-end, end, (50, 4))])
    left = np.maximum(0, -np.min(slack + steps @ jacobian.T, axis=1))
    for active in (np.zeros(21, dtype=bool), rng.random(21) < 0.3):
        other, bound = solved(active)
        assert other == pytest.approx(step, abs=1e-5)
        assert bound <= np.min(left) + 1e-9
        assert penalty < 1e9 or bound == pytest.approx(left[0], abs=1e-4)


def above_parabola(x: Array) -> Evaluation:
    """A large objective, 1e4 (x² + (y + 1)²), above the curved bound y ≥ x²."""
    off = x + np.array([0.0, 1.0])
    return Evaluation(1e4 * float(off @ off), 2e4 * off, np.array([x[1] - x[0] ** 2]), np.array([[-2 * x[0], 1.0]]))


@pytest.mark.parametrize("start", [(-3.0, 9.5), (1.5, 2.0), (4.0, 15.0)])
def test_a_search_does_not_stray_from_its_constraints_however_large_the_objective(start: tuple[float, float]) -> None:
    def after(steps: int, stray: float) -> Evaluation:
        return minimise(above_parabola, np.array(start), *WIDE, radius=2.0, most_iterations=steps, stray=stray).at

    allowed = 2 * above_parabola(np.array(start)).violation + 0.1
    assert max(after(steps, 0.1).violation for steps in range(1, 12)) <= allowed
    assert max(after(steps, np.inf).violation for steps in range(1, 12)) > 0.1
    assert after(1000, 0.1).value == pytest.approx(1e4)
