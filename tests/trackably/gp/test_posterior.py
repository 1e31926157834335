"""The posterior against the naive implementation beside it, its gradients against central differences, its limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trackably.gp import naive
from tests.trackably.gp.instances import REPRESENTATIVE, decaying_kernels, over
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import IllConditioned, Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT, Stencil, Stencils

NOISE = np.array([1.0, 0.5, 2.0, 1.0, 0.1, 3.0, 1.0])
SAMPLES = Samples([0.0, 0.13, 0.4, 0.55, 0.9, 1.4, 1.45, 2.0], [1.0, 0.4, -0.3, 0.1, 0.8, 2.0, 1.9, -1.0])
TIMES = np.array([-0.7, 0.0, 0.2, 0.55, 1.0, 1.42, 2.3, 4.0])

H = 0.05
STENCILS = {
    "scaled": Stencil((-2.0,), 0.1, 0.3),
    "difference": Stencil((-10.0, 10.0), 0.1, 1.0),
    "second_difference": Stencil((4.0, -8.0, 4.0), 0.5),
    "uneven": Stencil((0.3, 0.0, -0.7, 1.1), 0.07, 0.2),
}
POSITION, VELOCITY = Stencil((0.5, 0.5), H, 0.2), Stencil((-1 / H, 1 / H), H)
KINDS = Stencils((POSITION, VELOCITY, POINT), ("position", "velocity", "z1"), (0, 1, 1, 0, 2, 0, 1))
OF_KINDS = np.array([0.0, 0.0, 0.3, 0.4, 0.4, 0.9, 1.2]), np.array([0.05, 0.3, 0.2, 0.05, 0.1, 0.05, 0.3])
SEEN = {
    **{name: Samples(SAMPLES.times[:7], SAMPLES.values[:7], NOISE, stencil) for name, stencil in STENCILS.items()},
    "kinds": Samples(OF_KINDS[0], np.sin(3 * OF_KINDS[0]) + KINDS.places, OF_KINDS[1], KINDS),
}
SOME = {name: REPRESENTATIVE[name] for name in ("matern32_short", "nested")}
# From a single sample on, and both even and odd numbers of them.
SIZES = {n: 0.1 * np.cumsum(np.random.default_rng(n).uniform(0.1, 2, n)) for n in (1, 2, 3, 128, 131)}
CASES = {f"points-{name}": (kernel, SAMPLES) for name, kernel in REPRESENTATIVE.items()}
CASES |= {f"{seen}-{name}": (kernel, samples) for seen, samples in SEEN.items() for name, kernel in SOME.items()}
CASES |= {
    f"{n} samples": (SOME["matern32_short"], Samples(t, np.sin(t), 0.5 + np.sin(t) ** 2)) for n, t in SIZES.items()
}


@over(CASES, "kernel", "samples")
def test_posteriors_are_those_of_the_whole_matrix_and_their_gradients_central_differences(kernel, samples):
    prior, scale = Prior(kernel, 0.2, 0.3).as_learned(), float(kernel(np.zeros(())))
    posterior = Posterior(prior, samples)
    value, gradient = posterior.negative_log_marginal_likelihood()
    assert value == pytest.approx(naive.negative_log_marginal_likelihood(prior, samples), rel=1e-9, abs=1e-9)
    slopes = naive.by_log_hyperparameters(lambda p: naive.negative_log_marginal_likelihood(p, samples), prior)
    np.testing.assert_allclose(gradient, slopes, rtol=1e-6, atol=1e-6 * max(1, abs(value)))
    np.testing.assert_allclose(posterior.signal(TIMES), naive.mean(prior, samples, TIMES), rtol=1e-8, atol=1e-9)
    wanted = np.diag(naive.covariance(prior, samples, TIMES))
    np.testing.assert_allclose(posterior.variance_of(np.ones(1), 0.0, TIMES) / scale, wanted / scale, atol=1e-9)
    slopes = naive.by_log_hyperparameters(lambda p: naive.mean(p, samples, TIMES), prior)
    np.testing.assert_allclose(posterior.jets(TIMES, 0)[1:, 0], slopes, rtol=1e-6, atol=2e-6)
    jet, *gradient = posterior.jets(TIMES, 1)
    np.testing.assert_allclose(jet, posterior.signal.jet(TIMES, 1), rtol=1e-9, atol=1e-10)
    slopes = naive.by_log_hyperparameters(lambda p: Posterior(p, samples).signal.jet(TIMES, 1), prior)
    scale = 1e-6 * np.max(np.abs(slopes), axis=-1, keepdims=True)
    assert np.all(np.abs(gradient - slopes) <= 2e-6 + scale)


@given(decaying_kernels, st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=8), st.floats(1e-2, 10))
def test_variance_lies_between_zero_and_the_prior(kernel, values, noise_std):
    scale = float(kernel(np.zeros(())))
    samples = Samples(np.arange(len(values)) * 0.3, values)
    prior = Prior(kernel.as_learned(), noise_std * scale**0.5)
    variance = Posterior(prior, samples).variance_of(np.ones(1), 0.0, np.append(samples.times, np.linspace(-1, 4, 50)))
    assert np.all((variance >= 0) & (variance <= scale * (1 + 1e-12)))


def test_samples_of_changes_alone_say_nothing_of_the_mean():
    changes = Samples([0.0, 0.5, 1.3], [0.1, -0.2, 0.3], stencil=Stencil((-10.0, 10.0), 0.1))
    posterior = Posterior(Prior(SquaredExponential(1.0, 1.0), 0.1, 0.5), changes)
    assert posterior.with_likeliest_mean(-9.0, 9.0).prior.mean == 0.5


def test_a_hopeless_matrix_is_refused_with_the_hyperparameters_that_made_it():
    posterior = Posterior(
        Prior(SquaredExponential(2.0, 1000.0).as_learned(), 1e-12), Samples(np.arange(40) / 40, np.ones(40))
    )
    with pytest.raises(IllConditioned, match=r"signal_std = 2, lengthscale = 1e[+]03, noise_std = 1e-12"):
        _ = posterior.weights
