"""Sums of kernels whose centres are the same up to rounding."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum

KERNEL = SquaredExponential(1.3, 0.7)


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(-1, 1), st.floats(-1, 1)), max_size=30))
def test_terms_whose_centres_are_the_same_up_to_rounding_become_one(terms):
    at = np.array([0.1 * place + 3.0 for place, _, _ in terms])
    at += np.array([side for _, side, _ in terms]) * np.spacing(at)
    weights = np.array([weight for _, _, weight in terms])
    found = KernelSum.of_terms(KERNEL, 0.0, at, weights)
    assert len(found.centres) == len({place for place, _, _ in terms})
    t = np.linspace(0.0, 8.0, 50)
    np.testing.assert_allclose(found(t), [KERNEL(s - at) @ weights for s in t], rtol=0, atol=1e-12)
