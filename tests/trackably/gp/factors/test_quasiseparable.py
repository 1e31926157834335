"""Samples in blocks: against the dense path and against fifty digits, for blocks of any size; what is refused."""

import tracemalloc

import mpmath
import numpy as np
import pytest

from tests.trackably.gp.factors.factors import dense, disagreement, factorisations, posterior_at, with_factor
from trackably.gp.factorise import noise_variance, terms_of
from trackably.gp.factors.quasiseparable import Cut, Quasiseparable, blocks, reach, row_blocks
from trackably.gp.kernels.base import Product, Sum
from trackably.gp.kernels.matern import Matern32, Matern52, Matern72
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
    "in clusters": lambda n: np.sort(2.0 * np.floor(jittered(n)) + 1e-6 * np.arange(n)),
    "random": lambda n: np.sort(np.random.default_rng(n).uniform(0, STEP * n, n)),
}
STENCILS = {
    "values": POINT,
    "means": Stencil((0.5, 0.5), STEP),
    "close together": Stencil((1.0, 1.0), STEP / 7),
    "wide means": Stencil((0.3, 0.5, 0.2), STEP, 0.3),
    "differences": Stencil((-2.0, 2.0), STEP),
}


KERNELS = {
    "Matern32": lambda lengthscale: Matern32(1.3, lengthscale),
    "Matern52": lambda lengthscale: Matern52(1.3, lengthscale),
    "Matern72": lambda lengthscale: Matern72(1.3, lengthscale),
    "sum": lambda lengthscale: Sum(Matern32(1.3, lengthscale), Matern52(0.5, 3 * lengthscale)),
}


def in_blocks(posterior, fewest, by_tails=True):
    """The same posterior in blocks of so many samples: with tails, or without what is lost in rounding."""
    prior, samples, kernel = posterior.prior, posterior.samples, posterior.prior.kernel
    longest, own = samples.stencil.lags[-1][1], kernel.decays if by_tails else ()
    span = samples.times[-1] - samples.times[0]
    far = longest if own else longest + reach(kernel, span, 1e-18)
    cut = Cut(blocks(samples.times, far, fewest), own, not own or longest > 0)
    found = row_blocks(terms_of(samples), cut, kernel.value_and_gradient)
    return with_factor(posterior, Quasiseparable.of(found, noise_variance(prior, samples)))


@pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)
@pytest.mark.parametrize("times", TIMES.values(), ids=TIMES)
@pytest.mark.parametrize("stencil", STENCILS.values(), ids=STENCILS)
def test_agreement_with_the_dense_path(kernel, times, stencil):
    for lengthscale in (0.1, 2.0, 60.0):
        for noise in (0.1, 0.01):
            relative_noise = np.exp(RNG.uniform(-1, 1, 250)) if noise == 0.1 else None
            posterior = posterior_at(kernel(lengthscale), times(250), noise, relative_noise, stencil)
            found = factorisations(posterior).get(Quasiseparable)
            if found or lengthscale >= 2.0:  # the last lag may be longer than the process remembers
                assert disagreement(with_factor(posterior, found), dense(posterior)) < AGREEMENT


@pytest.mark.parametrize("fewest", [1, 3, 7, 40, 300])
@pytest.mark.parametrize("stencil", [POINT, STENCILS["wide means"]], ids=["values", "means"])
@pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)
def test_blocks_may_have_any_size(kernel, stencil, fewest):
    """Sums over blocks keep their digits: those of the inverse are sums of squares."""
    posterior = posterior_at(kernel(4.0), TIMES["jittered"](250), 0.01, None, stencil)
    assert disagreement(in_blocks(posterior, fewest), dense(posterior)) < AGREEMENT
    short = posterior_at(kernel(0.05), TIMES["jittered"](250), 0.01, None, stencil)
    assert disagreement(in_blocks(short, fewest, by_tails=False), dense(short)) < AGREEMENT


def test_digits_of_slow_processes_are_those_of_the_samples():
    """Samples that are dense beside the correlation time, in fifty digits: −2 ln p and its gradient."""
    n, rate, sigma, noise = 60, mpmath.sqrt(5) / 70, 4, 0.1
    posterior = posterior_at(Matern52(4.0, 70.0), STEP * np.arange(n), noise / sigma)
    value, gradient = in_blocks(posterior, 7).negative_log_marginal_likelihood()
    with mpmath.workdps(50):
        t = [mpmath.mpf(each) for each in posterior.samples.times.tolist()]
        y = mpmath.matrix([mpmath.mpf(each) - mpmath.mpf(0.1) for each in posterior.samples.values.tolist()])

        def cost(log_rate):
            scale = mpmath.exp(log_rate)
            k = mpmath.matrix(n, n)
            for i in range(n):
                for j in range(n):
                    x = scale * abs(t[i] - t[j])
                    k[i, j] = sigma**2 * (1 + x + x**2 / 3) * mpmath.exp(-x)
                k[i, i] += mpmath.mpf(posterior.prior.noise_std) ** 2
            factor = mpmath.cholesky(k)
            z = mpmath.lu_solve(k, y)
            log_determinant = 2 * mpmath.fsum(mpmath.log(factor[i, i]) for i in range(n))
            return (y.T * z)[0] + log_determinant + n * mpmath.log(2 * mpmath.pi)

        at, h = mpmath.log(rate), mpmath.mpf(10) ** -20
        wanted, slope = cost(at), (cost(at - h) - cost(at + h)) / (2 * h)
    assert value == pytest.approx(float(wanted), rel=1e-10)
    assert gradient[1] == pytest.approx(float(slope), rel=1e-8)


@pytest.mark.parametrize(
    ("kernel", "stencil"),
    [
        (Matern52(1.0, 2.0), Stencil((1.0, 1.0), 40.0)),  # the process forgets more within the lag than e⁻¹
        (Product(Matern52(1.0, 2.0), Matern32(1.0, 1.0)), POINT),
        (Sum(Matern52(1.0, 2.0), SquaredExponential(1.0, 2.0)), POINT),
        (SquaredExponential(1.0, 9.0), POINT),
    ],
    ids=str,
)
def test_what_is_left_to_other_factorisations(kernel, stencil):
    assert Quasiseparable not in factorisations(posterior_at(kernel, STEP * np.arange(250), 0.1, stencil=stencil))


def test_memory_grows_with_the_number_of_samples():
    times = STEP * np.arange(20_000)
    posterior = posterior_at(Matern52(1.0, 2.0), times, 0.1)
    tracemalloc.start()
    posterior.negative_log_marginal_likelihood()
    posterior.jets(times[:10], 0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert isinstance(posterior._factored, Quasiseparable)
    assert peak < 500 * times.nbytes
