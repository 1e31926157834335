"""Matérn kernels by differences: against the dense path, and against matrices in fifty digits; what is refused."""

import tracemalloc

import mpmath
import numpy as np
import pytest

from tests.trackably.gp.factors.factors import dense, disagreement, factorisations, posterior_at, with_factor
from trackably.gp.factors.markov_bands import (
    Markov,
    difference,
)
from trackably.gp.kernels.base import Product, Sum
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.stencil import POINT, Stencil

AGREEMENT = 1e-8
STEP = 0.1
RNG = np.random.default_rng(3)


def jittered(n):
    return STEP * np.arange(n) + np.random.default_rng(n).uniform(0, 0.8 * STEP, n)


TIMES = {
    "even": lambda n: STEP * np.arange(n),
    "late": lambda n: 1e3 + STEP * np.arange(n),
    "jittered": jittered,
    "with gaps": lambda n: jittered(n) + 7.0 * (np.arange(n) // 50),
    "random": lambda n: np.sort(np.random.default_rng(n).uniform(0, STEP * n, n)),
}
STENCILS = {
    "values": POINT,
    "means": Stencil((0.5, 0.5), STEP),
    "close together": Stencil((1.0, 1.0), STEP / 7),
    "wide means": Stencil((0.3, 0.5, 0.2), STEP, 0.3),
}


def markov(posterior):
    """The same, by differences; None where that is not offered."""
    factor = factorisations(posterior).get(Markov)
    return with_factor(posterior, factor) if factor else None


@pytest.mark.parametrize("kernel", [Matern32, Matern52])
@pytest.mark.parametrize("times", TIMES.values(), ids=TIMES)
@pytest.mark.parametrize("stencil", STENCILS.values(), ids=STENCILS)
def test_agreement_with_the_dense_path(kernel, times, stencil):
    taken = 0
    for lengthscale in (0.1, 1.0, 4.0):
        for noise in (1.0, 0.1, 0.01):
            relative_noise = np.exp(RNG.uniform(-1, 1, 250)) if noise == 0.1 else None
            posterior = posterior_at(kernel(1.3, lengthscale), times(250), noise, relative_noise, stencil)
            if banded := markov(posterior):
                taken += 1
                assert disagreement(banded, dense(posterior)) < AGREEMENT
    assert taken >= (0 if times is TIMES["random"] else 1)


def test_many_right_sides_at_once():
    posterior = posterior_at(Matern52(1.0, 1.0), TIMES["jittered"](300), 0.1)
    right = RNG.standard_normal((300, 250))
    found, wanted = (p(posterior)._factored.solve(right) for p in (markov, dense))
    np.testing.assert_allclose(found, wanted, atol=1e-10 * np.max(np.abs(wanted)))
    np.testing.assert_array_equal(markov(posterior)._factored.solve(right[:, 7]), found[:, 7])


def whole(bands):
    """The symmetric matrix with these bands."""
    n = bands.shape[1]
    lower = sum(np.diag(row[: n - q], -q) for q, row in enumerate(bands))
    return lower + np.tril(lower, -1).T


@pytest.mark.parametrize(("kernel", "degree"), [(Matern32(1.7, 3.0), 1), (Matern52(1.7, 3.0), 2)])
@pytest.mark.parametrize("stencil", STENCILS.values(), ids=STENCILS)
def test_covariances_of_differences_have_all_their_digits(kernel, degree, stencil):
    """Computed as D K Dᵀ they would have lost most of them."""
    times = np.array([0.0, 0.01, 0.02, 0.031, 0.05, 0.06, 0.07, 0.2, 2.3, 2.31, 2.33])
    n, (decay,) = len(times), kernel.decays
    found = difference(times, decay, stencil.lags)
    p, rate, deviation = degree + 1, mpmath.mpf(decay.rate), mpmath.mpf(kernel.signal_std)

    def covariance(r):
        x = rate * abs(r)
        return deviation**2 * (1 + x + (x**2 / 3 if degree == 2 else 0)) * mpmath.exp(-x)

    with mpmath.workdps(50):
        t = [mpmath.mpf(time) for time in times]
        # D, anew: rows that are orthogonal to all powers below p (or to those that fewer times allow) times e^(−λt).
        d = mpmath.zeros(n, n)
        for i in range(n):
            seen = range(max(0, i - p), i + 1)
            for j in seen:
                scale = mpmath.fprod((t[i] - t[k]) for k in seen if k != i)
                d[i, j] = mpmath.exp(rate * (t[j] - t[i])) * scale / mpmath.fprod(t[j] - t[k] for k in seen if k != j)
        k = mpmath.matrix(n, n)
        for i in range(n):
            for j in range(n):
                k[i, j] = mpmath.fsum(ratio * covariance(t[i] - t[j] + lag) for ratio, lag in stencil.lags)
        wanted = np.array((d * k * d.T).tolist(), dtype=float)
        differences = np.array(d.tolist(), dtype=float)
    np.testing.assert_allclose(np.tril(whole(found.differences)), differences, rtol=1e-12)
    scale = np.sqrt(wanted.diagonal())
    entries = whole(found.covariance) / np.outer(scale, scale)
    np.testing.assert_allclose(entries, wanted / np.outer(scale, scale), atol=1e-10)


@pytest.mark.parametrize(
    ("kernel", "times", "stencil"),
    [
        (Matern52(1.0, 50.0), STEP * np.arange(250), POINT),  # so dense that differences are lost in noise
        (Matern52(1.0, 1.0), np.sort(np.append(STEP * np.arange(250), 3.0 + 1e-9)), POINT),
        (Matern32(1.0, 0.02), np.append(1e-4 * np.arange(125), 3.0 + 1e-4 * np.arange(125)), POINT),
        (Matern32(1.0, 0.02), 9.0 * np.arange(250), POINT),  # e^x would overflow
        (Matern52(1.0, 2.0), STEP * np.arange(250), Stencil((1.0, 1.0), 40.0)),
        (Matern32(1.0, 2.0), STEP * np.arange(250), Stencil((-2.0, 2.0), STEP)),  # digits cancel in differences
        (Sum(Matern52(1.0, 2.0), Matern32(1.0, 1.0)), STEP * np.arange(250), POINT),
        (Product(Matern52(1.0, 2.0), Matern32(1.0, 1.0)), STEP * np.arange(250), POINT),
        (SquaredExponential(1.0, 0.3), STEP * np.arange(250), POINT),
    ],
    ids=str,
)
def test_what_is_left_to_other_factorisations(kernel, times, stencil):
    assert markov(posterior_at(kernel, times, 0.1, stencil=stencil)) is None


def test_memory_grows_with_the_number_of_samples():
    times = STEP * np.arange(20_000)
    posterior = posterior_at(Matern52(1.0, 2.0), times, 0.1)
    tracemalloc.start()
    posterior.negative_log_marginal_likelihood()
    posterior.jet_and_gradient(times[:10], 0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert isinstance(posterior._factored, Markov)
    assert peak < 150 * times.nbytes
