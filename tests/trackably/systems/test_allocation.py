"""Control allocation: attainable effects against linear programs, smallest inputs against quadratic programs."""

from functools import cache

import cvxpy as cp
import numpy as np
import pytest

from tests.trackably.gp.instances import over
from tests.trackably.systems.redundant_instances import (
    CASES,
    ONE_STATE,
    excess,
    least,
    regular_polygon,
)
from trackably.systems.allocation import Allocation
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope


@cache
def drawn(system: LinearSystem, wanted: Polytope) -> tuple[np.ndarray, np.ndarray]:
    """Smallest inputs of all, and by how much the set has to be widened for each."""
    inputs = least(system, wanted, 32)
    return inputs, np.array([excess(system, wanted, u) for u in inputs])


@over(CASES, "case")
def test_the_rows_say_what_a_linear_program_says(case):
    rows, (inputs, off) = Allocation.of(*case).attainable, drawn(*case)
    inside, clear = np.full(len(inputs), True), np.abs(off) > 1e-7
    for row, bounds in rows:
        inside &= bounds.margin(inputs @ np.array(row, dtype=float)) > 0
    np.testing.assert_array_equal(inside[clear], off[clear] < 0)
    assert sum(clear) > 25
    assert sum(inside) > 4


@over(CASES, "case")
def test_the_smallest_admissible_input_is_that_of_a_quadratic_program(case):
    (system, wanted), allocation = case, Allocation.of(*case)
    inputs, off = drawn(*case)
    chosen = allocation.smallest(inputs)
    np.testing.assert_allclose(chosen @ system.B.T, inputs @ system.B.T, atol=1e-12)
    inside = np.flatnonzero(off <= -1e-3)[:6]
    assert len(inside) > 2
    for u, found in zip(inputs[inside], chosen[inside], strict=True):
        v = cp.Variable(len(u))
        kept = [wanted.rows @ v <= wanted.upper, wanted.rows @ v >= wanted.lower, system.B @ v == system.B @ u]
        cp.Problem(cp.Minimize(cp.sum_squares(v)), kept).solve(solver=cp.CLARABEL)
        np.testing.assert_allclose(found, v.value, atol=1e-5)
        assert wanted.margin(found) > -1e-13


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


REFUSED = {
    "a bound that moves": (
        Polytope([[1.0, 1.0]], [-1.0], [{0.0: 1.0, 1.0: 2.0}]),
        "need constant bounds, but bounds of",
    ),
    "many rows": (regular_polygon(80), "1 redundant inputs are too many"),
}


@over(REFUSED, "case")
def test_input_sets_that_allocation_cannot_treat_are_refused(case):
    wanted, said = case
    with pytest.raises(ValueError, match=said):
        Allocation.of(ONE_STATE, wanted)
