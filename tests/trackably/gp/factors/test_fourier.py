"""Cosines and sines lead to the answers of the whole matrix wherever they are offered."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trackably.gp.factors.factors import dense, disagreement, factorisations, posterior_at, with_factor
from trackably.gp.factors.fourier import Fourier
from trackably.gp.kernels.base import Sum
from trackably.gp.kernels.squared_exponential import SquaredExponential

TIMES = np.sort(np.random.default_rng(5).uniform(0, 6, 120))


@given(
    st.floats(0.02, 300.0),
    st.floats(0.02, 300.0),
    st.integers(60, 150),
    st.floats(0.01, 2.0),
    st.floats(0.0, 1.0),
    st.sampled_from([0.0, -3.0, 1e4]),
    st.integers(0, 2**32 - 1),
)
def test_answers_are_those_of_the_whole_matrix(lengthscale, other, count, noise, spread, first, seed):
    rng = np.random.default_rng(seed)
    times = first + np.sort(rng.uniform(0, 5, count) + rng.choice([0.0, 4.0]) * (rng.random(count) < 0.5))
    kernel = Sum(SquaredExponential(1.0, lengthscale), SquaredExponential(0.3, other))
    posterior = posterior_at(kernel, times, noise, np.exp(rng.uniform(-spread, spread, count)))
    if factor := factorisations(posterior).get(Fourier):
        assert disagreement(with_factor(posterior, factor), dense(posterior)) < 1e-8


@pytest.mark.parametrize("rungs", [-4, -2, 0, 3])
def test_the_likelihood_does_not_jump_from_one_period_to_the_next(rungs):
    density = SquaredExponential(1.0, 1.0).spectral_density
    lengthscale = (TIMES[-1] - TIMES[0]) / density.reach * 2 ** (rungs / 4)
    objectives, periods = [], []
    for factor in (1 - 1e-9, 1 + 1e-9):
        posterior = posterior_at(SquaredExponential(1.0, factor * lengthscale), TIMES, 0.1)
        found = factorisations(posterior)[Fourier]
        periods.append(found.waves.period)
        value, gradient = with_factor(posterior, found).negative_log_marginal_likelihood()
        objectives.append(value - (factor - 1) * gradient[1])
    assert periods[0] < periods[1]
    assert objectives[0] == pytest.approx(objectives[1], rel=1e-12)
