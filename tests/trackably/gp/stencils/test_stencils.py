"""Samples of several kinds of one process: as if each were a weighted sum of the process, written out plainly."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trackably.gp.instances import KERNELS
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT, Stencil, Stencils

H = 0.05
MIDDLE, SLOPE = Stencil((0.5, 0.5), H, 0.2), Stencil((-1 / H, 1 / H), H)
TIMES = np.array([0.0, 0.0, 0.3, 0.4, 0.4, 0.9, 1.2])
KINDS = Stencils((MIDDLE, SLOPE, POINT), ("position", "velocity", "z1"), (0, 1, 1, 0, 2, 0, 1))
VALUES, NOISE = np.sin(3 * TIMES) + KINDS.places, np.array([0.05, 0.3, 0.2, 0.05, 0.1, 0.05, 0.3])
SAMPLES = Samples(TIMES, VALUES, NOISE, KINDS)
GRID = np.linspace(-0.5, 2.0, 31)


def naive(prior: Prior, samples: Samples):
    """Return the instants that matter, S with y = o + S g + noise, the covariance of y, and y − o − S m."""
    stencils = samples.stencil
    instants, S = [], np.zeros((len(samples), 0))
    offsets = []
    for i, (t, kind) in enumerate(zip(samples.times.tolist(), stencils.of, strict=True)):
        part = stencils.parts[kind]
        offsets.append(part.offset)
        for j, w in enumerate(part.weights):
            column = np.zeros((len(samples), 1))
            column[i] = w
            S = np.hstack([S, column])
            instants.append(t + j * part.step)
    at = np.array(instants)
    A = S @ prior.kernel(at[:, None] - at) @ S.T + np.diag((prior.noise_std * samples.relative_noise) ** 2)
    return at, S, A, samples.values - np.array(offsets) - S @ np.full(len(at), prior.mean)


def prior_of(kernel) -> Prior:
    return Prior(kernel, 0.7, 0.3).as_learned()


@pytest.mark.parametrize("name", KERNELS)
def test_the_posterior_is_that_of_weighted_sums(name: str) -> None:
    prior = prior_of(KERNELS[name])
    at, S, A, residual = naive(prior, SAMPLES)
    posterior, inverse = Posterior(prior, SAMPLES), np.linalg.inv(A)
    cross = prior.kernel(GRID[:, None] - at) @ S.T
    scale = math.sqrt(prior.kernel(np.zeros(())).item())
    np.testing.assert_allclose(posterior.mean(GRID), prior.mean + cross @ inverse @ residual, atol=1e-8 * max(scale, 1))
    variance = scale**2 - np.einsum("ij,jk,ik->i", cross, inverse, cross)
    np.testing.assert_allclose(posterior.variance(GRID), variance, atol=1e-7 * scale**2)
    nlml = np.linalg.slogdet(A)[1] + residual @ inverse @ residual + len(SAMPLES) * math.log(2 * math.pi)
    assert posterior.negative_log_marginal_likelihood()[0] == pytest.approx(nlml, rel=1e-8)


@pytest.mark.parametrize("name", ["se_short", "matern32_short", "periodic_pi", "nested"])
def test_gradients_are_those_of_differences(name: str) -> None:
    prior, step = prior_of(KERNELS[name]), 1e-5
    theta = prior.log_hyperparameters
    _, gradient = Posterior(prior, SAMPLES).negative_log_marginal_likelihood()
    slopes = Posterior(prior, SAMPLES).mean_gradient(GRID)
    for j in range(len(theta)):
        beside = [
            Posterior(prior.with_log_hyperparameters(theta + s * step * np.eye(len(theta))[j]), SAMPLES)
            for s in (1, -1)
        ]
        up, down = (at.negative_log_marginal_likelihood()[0] for at in beside)
        assert gradient[j] == pytest.approx((up - down) / (2 * step), rel=1e-4, abs=1e-4)
        np.testing.assert_allclose(slopes[j], (beside[0].mean(GRID) - beside[1].mean(GRID)) / (2 * step), atol=1e-4)


def test_one_kind_is_no_different() -> None:
    times = np.linspace(0, 2, 9)
    alone = Samples(times, np.cos(times), np.ones(9), SLOPE)
    among = Samples(times, np.cos(times), np.ones(9), Stencils((SLOPE,), ("velocity",), (0,) * 9))
    prior = prior_of(SquaredExponential(1.0, 0.6))
    one, other = Posterior(prior, alone), Posterior(prior, among)
    np.testing.assert_allclose(one.mean(GRID), other.mean(GRID), atol=1e-10)
    assert one.negative_log_marginal_likelihood()[0] == pytest.approx(other.negative_log_marginal_likelihood()[0])


def test_each_kind_by_its_name() -> None:
    parts = SAMPLES.by_name("ignored")
    assert [*parts] == ["position", "velocity", "z1"]
    np.testing.assert_array_equal(parts["velocity"].times, [0.0, 0.3, 1.2])
    np.testing.assert_array_equal(parts["velocity"].relative_noise, [0.3, 0.2, 0.3])
    assert parts["velocity"].stencil == SLOPE
    assert SAMPLES.of_level.stencil == MIDDLE
    assert Samples([0.0], [1.0], [1.0], SLOPE).of_level.stencil == SLOPE
    chosen = KINDS.only(np.array([1, 2, 6]))
    assert chosen == SLOPE
    assert KINDS.only(np.array([1, 4])) == Stencils((SLOPE, POINT), ("velocity", "z1"), (0, 1))


@given(st.floats(-5, 5))
def test_a_process_at_rest_is_measured_as_such(level: float) -> None:
    np.testing.assert_allclose(
        KINDS.measured(lambda t: np.full_like(t, level), TIMES), KINDS.at_rest(level), atol=1e-12
    )
