"""The invariant set: its definition, in exact arithmetic, on systems of all kinds."""

from dataclasses import replace
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
    assert replace(Z) in {Z}
    closed = exact(Z.A) + exact(Z.B) @ exact(Z.K)
    for row in exact(np.random.default_rng(1).integers(-9, 10, (4, len(closed)))):
        moved = (row @ closed).tolist()
        of_moved, of_row = (Fraction(*Z.support(of)) for of in (moved, row.tolist()))
        assert of_moved + exact_support(Z.disturbance, row.tolist()) <= of_row


@pytest.mark.parametrize("name", ALL)
def test_the_worst_disturbances_nearly_reach_the_bounds_of_the_set(name):
    """Greedy vertices reach what is taken from each end of each bound, but for some hundredths."""
    found = ALL[name].tightening
    Z, every = found.invariant, [taken for _, of_rows in found.sides for taken in of_rows]
    for of, taken in zip(found.given.given_constraints, every, strict=True):
        row = np.array(of.row, dtype=float)
        of_state = row if of.side == "state" else row @ Z.feedback
        for sign, by in zip((-1, 1), map(float, taken), strict=True):
            reached, power = 0.0, sign * of_state
            for _ in range(3 * (Z.head + Z.terms)):
                reached += float(power @ Z.disturbance.farthest(power))
                power = power @ Z.closed_loop
            assert reached <= by * (1 + 1e-12)
            assert by <= 1.03 * reached + 2e-5 * of.bounds.width
