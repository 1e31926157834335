"""Sums of kernels whose centres are the same up to rounding."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum
from trackably.gp.stencil import Stencil

KERNEL = SquaredExponential(1.3, 0.7)


@pytest.mark.parametrize(
    "stencil", [Stencil((0.5, 0.5), 0.1), Stencil((-10.0, 10.0), 0.1), Stencil((1.0, -2.0, 1.0), 0.1)]
)
def test_regular_samples_with_several_lags_share_their_centres(stencil):
    times = 0.1 * np.arange(300) + 12.3
    posterior = Posterior(Prior(KERNEL, 0.1), Samples(times, np.sin(times), stencil=stencil))
    assert len(posterior.signal.centres) == len(times) + len(stencil.weights) - 1
    assert np.all(np.diff(posterior.signal.centres) > 0.09)
    spread = stencil.spread(posterior.weights)
    apart = KernelSum(KERNEL, 0.0, stencil.centres(times), spread)
    t = np.linspace(10.0, 45.0, 400)
    np.testing.assert_allclose(posterior.signal.jet(t, 2), apart.jet(t, 2), rtol=0, atol=1e-11 * np.abs(spread).max())


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(-1, 1), st.floats(-1, 1)), max_size=30))
def test_terms_whose_centres_are_the_same_up_to_rounding_become_one(terms):
    at = np.array([0.1 * place + 3.0 for place, _, _ in terms])
    at += np.array([side for _, side, _ in terms]) * np.spacing(at)
    weights = np.array([weight for _, _, weight in terms])
    found = KernelSum.of_terms(KERNEL, 0.0, at, weights)
    assert len(found.centres) == len({place for place, _, _ in terms})
    t = np.linspace(0.0, 8.0, 50)
    np.testing.assert_allclose(found(t), [KERNEL(s - at) @ weights for s in t], rtol=0, atol=1e-12)
