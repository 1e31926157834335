"""Control allocation: attainable effects against linear programs, smallest inputs against quadratic programs."""

import cvxpy as cp
import numpy as np

from tests.trackably.gp.instances import over
from tests.trackably.systems.redundant_instances import (
    CASES,
    excess,
    least,
)
from trackably.systems.allocation import Allocation
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope


@over(CASES, "case")
def test_the_rows_say_what_a_linear_program_says(case):
    system, wanted = case
    rows = Allocation.of(system, wanted).attainable
    inside = []
    for u in least(system, wanted, 40):
        margins = [bounds.margin(np.dot([float(r) for r in row], u)) for row, bounds in rows]
        if abs(off := excess(system, wanted, u)) > 1e-7:
            assert (min(margins, default=1.0) > 0) == (off < 0)
            inside.append(off < 0)
    assert len(inside) > 30
    assert sum(inside) > 5


@over(CASES, "case")
def test_the_smallest_admissible_input_is_that_of_a_quadratic_program(case):
    system, wanted = case
    allocation = Allocation.of(system, wanted)
    inputs = least(system, wanted, 15)
    chosen = allocation.smallest(inputs)
    np.testing.assert_allclose(chosen @ system.B.T, inputs @ system.B.T, atol=1e-12)
    admissible = [excess(system, wanted, u) <= -1e-7 for u in inputs]
    assert sum(admissible) > 2
    for u, found in zip(inputs[admissible], chosen[admissible], strict=True):
        v = cp.Variable(len(u))
        kept = [wanted.rows @ v <= wanted.upper, wanted.rows @ v >= wanted.lower, system.B @ v == system.B @ u]
        cp.Problem(cp.Minimize(cp.sum_squares(v)), kept).solve(solver=cp.CLARABEL)
        np.testing.assert_allclose(found, v.value, atol=1e-5)
        assert wanted.margin(found) > -1e-13


@over(CASES, "case")
def test_slopes_are_those_of_the_smallest_input(case):
    system, wanted = case
    allocation = Allocation.of(system, wanted)
    onto, step = np.linalg.pinv(system.B) @ system.B, 1e-7
    # With one step inside and the next outside, the law may change: only inputs well inside.
    inside = [u for u in least(system, wanted, 15) if excess(system, wanted, u) <= -1e-3]
    assert len(inside) > 1
    for u in inside:
        for direction in onto.T:
            ends = allocation.smallest(np.array([u + step * direction, u - step * direction]))
            np.testing.assert_allclose(allocation.slopes(u) @ direction, (ends[0] - ends[1]) / (2 * step), atol=1e-6)


@over(
    {
        "none is admissible: the wide side gives more": ([1.0, 1.0], [-1.0, -0.2], [1.0, 0.2], 1.4, [1.2, 0.2]),
        "a bound never reached": ([1.0, 1.0], [-1.0, 0.0], [1.0, 1e13], -0.8, [-0.8, 0.0]),
        "narrow and far": ([1.0] * 3, [300.0, 300.0, 0.0], [300.01, 300.01, 1e3], 700.3, [300.0, 300.0, 100.3]),
    },
    "case",
)
def test_the_smallest_input_in_sets_of_all_widths(case):
    """Where none is admissible, the set is left by as small a part of its widths as possible."""
    row, lower, upper, push, wanted = case
    system = LinearSystem(np.array([[0.5]]), np.array([row]), sampling_time=0.1)
    found = Allocation.of(system, Polytope.box(lower, upper)).smallest(np.full(len(row), push / len(row)))
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-12)
