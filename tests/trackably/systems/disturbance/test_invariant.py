"""The invariant set: its definition, in exact arithmetic, on systems of all kinds."""

from fractions import Fraction

import numpy as np
import pytest

from tests.trackably.systems.disturbance.instances import ALL, CART, DISTURBED
from tests.trackably.systems.disturbance.naive import exact_support, naive_support
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.rationals import exact
from trackably.systems.tightening import NoInvariantSetError, tightening


def exact_rows(seed: int, n: int, count: int = 4) -> list[list[Fraction]]:
    rows = np.random.default_rng(seed).integers(-9, 10, (count, n)).tolist()
    return [[Fraction(r) for r in row] for row in rows if any(row)]


@pytest.mark.parametrize("name", ALL)
def test_the_set_is_invariant(name):
    """A_K Z ⊕ W ⊆ Z: h_Z(A_Kᵀ row) + h_W(row) ≤ h_Z(row), without any tolerance."""
    Z = ALL[name].tightening.invariant
    closed, n = exact(Z.system.A) + exact(Z.system.B) @ exact(Z.feedback), len(Z.system.A)
    for row in exact_rows(1, n):
        moved = [sum((row[i] * closed[i, j] for i in range(n)), Fraction(0)) for j in range(n)]
        assert Z.support(moved) + exact_support(Z.disturbance, row) <= Z.support(row)


@pytest.mark.parametrize("name", ALL)
def test_the_support_is_that_of_the_definition(name):
    Z = ALL[name].tightening.invariant
    for row in exact_rows(2, len(Z.box), 2):
        assert Z.support(row) == naive_support(Z, row)


def test_the_support_is_exact_where_units_of_states_differ():
    """Whole numbers of 64 bits beside smaller ones were once rounded."""
    system = LinearSystem([[0.5, 0.2], [0.0, 0.7]], [[0.0], [1.0]], sampling_time=1.0)
    plant = ConstrainedSystem(system, Polytope.box([-1e3, -1.0], [1e3, 1.0]), Polytope.box([-1.0], [1.0]))
    for ratio in np.geomspace(1e3, 1e4, 10):
        w = np.array([1e-3 * ratio, 1e-3])
        Z = tightening(plant, Zonotope.box(-w, w), [[0.0, -0.1]]).invariant
        assert all(Z.support(row) == naive_support(Z, row) for row in exact_rows(3, 2, 2))


@pytest.mark.parametrize("name", ALL)
def test_the_worst_disturbances_nearly_reach_the_bounds_of_the_set(name):
    """Greedy vertices reach what Z allows for each row that is bounded, but for some hundredths."""
    found = ALL[name].tightening
    Z = found.invariant
    for row, side in [(c.row, c.side) for c in found.given.given_constraints]:
        of_state = np.array([float(r) for r in row])
        of_state = of_state if side == "state" else of_state @ Z.feedback
        reached, power = 0.0, of_state
        for _ in range(3 * (Z.head + Z.terms)):
            reached += float(power @ Z.disturbance.farthest(power))
            power = power @ Z.closed_loop
        allowed = float(Z.support(list(row) if side == "state" else (exact(row) @ exact(Z.feedback)).tolist()))
        width = next(c.bounds.width for c in found.given.given_constraints if c.row == row and c.side == side)
        assert reached <= allowed * (1 + 1e-12)
        assert allowed <= 1.03 * reached + 2e-5 * width


def test_a_feedback_under_which_errors_grow_is_refused():
    with pytest.raises(NoInvariantSetError, match=r"inside the unit circle, but one has the size 1\.1"):
        tightening(CART, DISTURBED["pushed"].disturbance, [[1.0, 1.0]])
