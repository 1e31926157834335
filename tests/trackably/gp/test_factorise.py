"""Each factorisation against the dense one, on all kinds of times and noise."""

import pickle
from math import inf, tau

import numpy as np
import pytest

from tests.trackably.gp.factors.factors import disagreement, factorisations, posterior_at, with_factor
from tests.trackably.gp.instances import KERNELS, over
from trackably.gp.factors.dense import Dense
from trackably.gp.factors.fourier import Fourier, cosines
from trackably.gp.factors.quasiseparable import Quasiseparable
from trackably.gp.kernels.base import Product, Sum
from trackably.gp.kernels.matern import Matern32
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT, Stencil

AGREEMENT = 1e-8


def random(n, lower, upper):
    return np.random.default_rng(n).uniform(lower, upper, n)


TIMES = {
    "even": lambda n: 0.05 * np.arange(n),
    "random": lambda n: np.sort(random(n, 0, n / 20)),
    "since 1970": lambda n: 1.7e9 + np.sort(random(n, 0, n / 20)),
    "in two parts": lambda n: np.sort(np.append(random(n // 2, 0, 2), random(n - n // 2, 30, 31))),
    "in clusters": lambda n: np.sort(3.0 * np.floor(random(n, 0, 20)) + random(n + 1, 0, 0.1)[1:]),
}


# Which factorisations are offered depends on decay, smoothness and correlation time: each family in its extremes.
_NAMES = "se", "se_short", "piecewise3_loud", "matern32_short", "matern52_long", "sum_of_smooth"
FAMILIES = {name: KERNELS[name] for name in _NAMES} | {
    "rq_long": RationalQuadratic(1.0, 6.0, 1.0),
    "periodic_short": Periodic(1.0, 1.0, 0.55),
    "quasi_periodic_long": Product(SquaredExponential(1.0, 9.0), Periodic(1.0, 1.5, 6.0)),
}
SEEN = [
    *((noise, spread, POINT) for noise, spread in [(1.0, 0.0), (0.1, 1.0), (0.01, 0.0), (1e-3, 1.0), (1e-4, 0.0)]),
    (0.1, 0.0, Stencil((0.5, 0.5), 0.05)),
    (0.1, 0.0, Stencil((-2.0, 2.0), 0.05)),
    (0.1, 0.0, Stencil((2.0, -3.0, 1.0), 0.3, 0.4)),
    (0.1, 0.0, Stencil((1.0, 1.0), 40.0)),
]


@over(FAMILIES)
@over(TIMES, "times")
def test_all_factorisations_lead_to_the_same_answers(kernel, times):
    """With equal noise and with unequal noise, of samples of one instant and of several."""
    for noise, spread, stencil in SEEN:
        posterior = posterior_at(kernel, times(200), noise, np.exp(random(200, -spread, spread)), stencil)
        found = factorisations(posterior)
        whole = with_factor(posterior, found.pop(Dense))
        for factor in found.values():
            assert disagreement(with_factor(posterior, factor), whole) < AGREEMENT


@pytest.mark.parametrize(
    ("kernel", "n", "noise", "wanted"),
    [
        (SquaredExponential(1.0, 0.5), 100, 0.1, Fourier),
        (SquaredExponential(1.0, 0.5), 40, 0.1, Dense),
        (SquaredExponential(1.0, 0.1), 1000, 0.1, Quasiseparable),
        (SquaredExponential(1.0, 5.0), 1000, 0.1, Fourier),
        (FAMILIES["quasi_periodic_long"], 1000, 0.1, Fourier),
        (Matern32(1.0, 2.0), 500, 0.1, Quasiseparable),
        (Matern32(1.0, 2.0), 500, 1e-3, Quasiseparable),
        (Matern32(1.0, 2.0), 500, 1e-5, Dense),
        (PiecewisePolynomial2(1.0, 0.3), 1000, 0.1, Quasiseparable),
        (Periodic(1.0, 1.0, 10.0), 100, 0.1, Fourier),
    ],
)
def test_the_fastest_factorisation_is_taken(kernel, n, noise, wanted):
    posterior = posterior_at(kernel, TIMES["random"](n), noise)
    assert isinstance(posterior._factored, wanted)
    assert len(pickle.loads(pickle.dumps(posterior.samples))) == n  # with what is kept for the next likelihood


@over({name: KERNELS[name] for name in ("se", "matern52", "rq_third", "periodic_pi", "sum")})
def test_where_rounding_would_decide_only_the_dense_matrix_is_offered(kernel):
    posterior = posterior_at(kernel, TIMES["even"](300), 1e-5)
    found = factorisations(posterior)
    assert found.keys() == {Dense}
    assert posterior.weights.tobytes() == with_factor(posterior, found[Dense]).weights.tobytes()


def test_whole_periods_between_samples_change_nothing():
    prior, within, values, means = Prior(Periodic(1.0, 0.5, 1.0), 0.1), np.arange(5000) / 2**13, random(5000, -1, 1), []
    for apart in (0.0, 2.0**20):  # of samples in the first period, or of one sample in a million periods each
        times = within + apart * np.arange(1, 5001)
        means.append(Posterior(prior, Samples(times, values)).signal(times[0] + within))
    np.testing.assert_allclose(*means, rtol=0, atol=1e-11)


def cosine(waves, lengthscale=inf):
    """A covariance of the period 1 that decays with the length scale."""
    return lambda r: (np.cos(tau * waves * r) * np.exp(-((r / lengthscale) ** 2)), r[None][:0])


@over(
    {str(waves): cosine(waves) for waves in (120, 130, 255, 400, 511)}
    | {
        "no period": SquaredExponential(1.0, 0.06).value_and_gradient,
        "a weak wave": lambda r: (1 + 1e-13 * cosine(255)(r)[0], r[None][:0]),
        "zero": SquaredExponential(1e-170, 0.06).value_and_gradient,
    },
    "covariance",
)
def test_sums_of_cosines_that_are_wrong_between_few_points_are_not_taken(covariance):
    assert cosines(covariance, 1.0, 0.5, 1.0, 128) is None


def test_a_fast_wave_that_decays_is_not_taken_for_a_slow_one():
    slow, fast = (cosines(cosine(waves, 0.01), 1.0, 0.06, 0.9, 512) for waves in (0, 1024))
    assert slow
    assert fast is None


def test_waves_that_are_kept_for_the_next_likelihoods_take_little_memory():
    samples = Samples(np.linspace(0.0, 1.0, 30_000), np.zeros(30_000))
    for lengthscale in (0.02, 0.025, 0.03):
        assert samples.ladder.waves(SquaredExponential(1.0, lengthscale), 500)
    assert len(pickle.dumps(samples)) < 8e7


def test_samples_that_no_factorisation_holds_in_memory_are_refused():
    """A sum with a smooth kernel is no sum of tails, nor smooth, and correlates thousands of these samples."""
    kernel, times = Sum(Matern32(1.0, 50.0), SquaredExponential(1.0, 50.0)), np.sort(random(100_000, 0, 1e4))
    with pytest.raises(ValueError, match=r"^samples: 100000 are too many for a correlation time of 35.4 s within 99"):
        posterior_at(kernel, times, 0.1).negative_log_marginal_likelihood()
