"""Samples that see a process through a stencil, with noise of their own: against a naive, dense computation."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trackably.gp import naive
from tests.trackably.gp.instances import KERNELS, over
from tests.trackably.gp.stencils import naive as naive_stencil
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT, Stencil

TIMES = np.array([-0.7, 0.0, 0.2, 0.55, 1.0, 1.42, 2.3, 4.0])
VALUES = np.array([1.0, 0.4, -0.3, 0.1, 0.8, 2.0, 1.9])
NOISE = np.array([1.0, 0.5, 2.0, 1.0, 0.1, 3.0, 1.0])
SAMPLED = [0.0, 0.13, 0.4, 0.55, 0.9, 1.4, 1.45]

STENCILS = {
    "point": POINT,
    "scaled": Stencil((-2.0,), 0.1, 0.3),
    "later": Stencil((0.0, 1.0), 0.13),
    "mean": Stencil((0.5, 0.5), 0.05, -0.4),
    "difference": Stencil((-10.0, 10.0), 0.1, 1.0),
    "second_difference": Stencil((4.0, -8.0, 4.0), 0.5),
    "uneven": Stencil((0.3, 0.0, -0.7, 1.1), 0.07, 0.2),
}
SOME_KERNELS = {k: KERNELS[k] for k in ("matern32_short", "periodic", "nested")}


def samples(stencil: Stencil, relative_noise=NOISE) -> Samples:
    return Samples(SAMPLED, VALUES, relative_noise, stencil)


def prior_of(kernel) -> Prior:
    return Prior(kernel, noise_std=0.2, mean=0.3).as_learned()


@over(STENCILS, "stencil")
@over(SOME_KERNELS)
def test_posteriors_against_the_naive_ones(kernel, stencil):
    prior, seen = prior_of(kernel), samples(stencil)
    posterior, scale = Posterior(prior, seen), float(kernel(np.zeros(())))
    np.testing.assert_allclose(posterior.mean(TIMES), naive_stencil.mean(prior, seen, TIMES), rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(
        posterior.variance(TIMES) / scale, naive_stencil.variance(prior, seen, TIMES) / scale, atol=1e-9
    )
    value, gradient = posterior.negative_log_marginal_likelihood()
    assert value == pytest.approx(naive_stencil.negative_log_marginal_likelihood(prior, seen), rel=1e-9, abs=1e-8)
    slopes = naive.by_log_hyperparameters(lambda p: naive_stencil.negative_log_marginal_likelihood(p, seen), prior)
    np.testing.assert_allclose(gradient, slopes, rtol=1e-5, atol=1e-5 * max(1, abs(value)))


@over(STENCILS, "stencil")
@over(SOME_KERNELS)
def test_gradients_of_the_jet_against_central_differences(kernel, stencil):
    prior, seen = prior_of(kernel), samples(stencil)
    jet, gradient = Posterior(prior, seen).jet_and_gradient(TIMES, 1)
    np.testing.assert_allclose(jet, Posterior(prior, seen).signal.jet(TIMES, 1), rtol=1e-9, atol=1e-10)
    slopes = naive.by_log_hyperparameters(lambda p: Posterior(p, seen).signal.jet(TIMES, 1), prior)
    scale = 1e-6 * np.max(np.abs(slopes), axis=-1, keepdims=True)
    assert np.all(np.abs(gradient - slopes) <= 2e-6 + scale)


@over(STENCILS, "stencil")
def test_what_is_sampled_without_noise_is_seen_again(stencil):
    prior = replace(prior_of(SquaredExponential(1.0, 0.3)), noise_std=1e-4)
    times = np.arange(5) * 0.8
    seen = Samples(times, VALUES[:5], stencil=stencil)
    signal = Posterior(prior, seen).signal
    again = stencil.offset + sum(w * signal(times + j * stencil.step) for j, w in enumerate(stencil.weights))
    np.testing.assert_allclose(again, seen.values, atol=1e-4)


def test_a_sample_with_hardly_any_weight_hardly_matters():
    prior = prior_of(SquaredExponential(1.0, 0.5))
    loud = np.where(np.arange(7) == 3, 1e6, 1.0)
    kept = [0, 1, 2, 4, 5, 6]
    without = Samples(np.array(SAMPLED)[kept], VALUES[kept])
    np.testing.assert_allclose(
        Posterior(prior, samples(POINT, loud)).mean(TIMES), Posterior(prior, without).mean(TIMES), atol=1e-8
    )


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=5).filter(any), st.floats(0, 2), st.floats(-2, 2))
def test_centres_spread_and_lags_against_loops(weights, step, offset):
    stencil, t, values = Stencil(tuple(weights), step, offset), np.array([0.0, 0.7, 3.1]), np.array([1.0, -2.0, 0.5])
    pairs = {(i, j): (t[i] + j * step, w * values[i]) for i in range(3) for j, w in enumerate(weights)}
    found = sorted(zip(stencil.centres(t).tolist(), stencil.spread(values).tolist(), strict=True))
    np.testing.assert_allclose(found, sorted(pairs.values()), atol=1e-12)
    twice = stencil.spread(np.stack([values, 2 * values]))
    np.testing.assert_allclose(twice[1], 2 * stencil.spread(values))
    correlation = dict.fromkeys(range(1 - len(weights), len(weights)), 0.0)
    for j, one in enumerate(weights):
        for k, other in enumerate(weights):
            correlation[j - k] += one * other
    lags = stencil.lags
    assert [lag for _, lag in lags] == [d * step for d in correlation]
    np.testing.assert_allclose([rho for rho, _ in lags], list(correlation.values()), atol=1e-12)
    assert stencil.at_rest(1.7) == pytest.approx(offset + sum(1.7 * w for w in weights), abs=1e-12)
