"""The invariant set: its definition, in exact arithmetic, on systems of all kinds."""

from fractions import Fraction

import numpy as np
import pytest

from tests.trackably.systems.disturbance.instances import ALL
from tests.trackably.systems.disturbance.naive import exact_support
from trackably.systems.rationals import exact


@pytest.mark.parametrize("name", ALL)
def test_the_set_is_invariant(name):
    """A_K Z ⊕ W ⊆ Z: h_Z(A_Kᵀ row) + h_W(row) ≤ h_Z(row), without any tolerance."""
    Z = ALL[name].tightening.invariant
    closed = exact(Z.A) + exact(Z.B) @ exact(Z.K)
    for row in exact(np.random.default_rng(1).integers(-9, 10, (4, len(closed)))):
        moved = (row @ closed).tolist()
        of_moved, of_row = (Fraction(*Z.support(of)) for of in (moved, row.tolist()))
        assert of_moved + exact_support(Z.disturbance, row.tolist()) <= of_row


@pytest.mark.parametrize("name", ALL)
def test_the_worst_disturbances_nearly_reach_the_bounds_of_the_set(name):
    """Greedy vertices reach what Z allows for each row that is bounded, but for some hundredths."""
    found = ALL[name].tightening
    Z = found.invariant
    for of in found.given.given_constraints:
        rational = exact(of.row) if of.side == "state" else exact(of.row) @ exact(Z.feedback)
        of_state = rational.astype(float)
        reached, power = 0.0, of_state
        for _ in range(3 * (Z.head + Z.terms)):
            reached += float(power @ Z.disturbance.farthest(power))
            power = power @ Z.closed_loop
        allowed = float(Fraction(*Z.support(rational.tolist())))
        assert reached <= allowed * (1 + 1e-12)
        assert allowed <= 1.03 * reached + 2e-5 * of.bounds.width
