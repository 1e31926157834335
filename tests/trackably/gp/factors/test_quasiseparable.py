"""Samples in blocks: against fifty digits, and in little memory."""

import tracemalloc

import mpmath
import numpy as np
import pytest

from tests.trackably.gp.factors.factors import posterior_at, with_factor
from trackably.gp.factorise import noise_variance, terms_of
from trackably.gp.factors.quasiseparable import Cut, Quasiseparable, blocks, row_blocks
from trackably.gp.kernels.matern import Matern52

STEP = 0.1


def test_digits_of_slow_processes_are_those_of_the_samples():
    """Samples that are dense beside the correlation time, in fifty digits: −2 ln p and its gradient."""
    n, rate, sigma, noise = 24, mpmath.sqrt(5) / 70, 4, 0.1
    posterior = posterior_at(Matern52(4.0, 70.0), STEP * np.arange(n), noise / sigma)
    samples, kernel = posterior.samples, posterior.prior.kernel
    sevens = Cut(blocks(samples.times, 0.0, 7), kernel.decays)
    found = row_blocks(terms_of(samples), sevens, kernel.value_and_gradient)
    factor = Quasiseparable.of(found, noise_variance(posterior.prior, samples))
    value, gradient = with_factor(posterior, factor).negative_log_marginal_likelihood()
    with mpmath.workdps(50):
        t = [mpmath.mpf(each) for each in posterior.samples.times.tolist()]
        y = mpmath.matrix([mpmath.mpf(each) - mpmath.mpf(0.1) for each in posterior.samples.values.tolist()])

        def cost(log_rate):
            x = [[mpmath.exp(log_rate) * abs(one - other) for other in t] for one in t]
            k = sigma**2 * mpmath.matrix([[(1 + v + v**2 / 3) * mpmath.exp(-v) for v in row] for row in x])
            k += mpmath.mpf(posterior.prior.noise_std) ** 2 * mpmath.eye(n)
            return (y.T * mpmath.lu_solve(k, y))[0] + mpmath.log(mpmath.det(2 * mpmath.pi * k))

        at, h = mpmath.log(rate), mpmath.mpf(10) ** -20
        wanted, slope = cost(at), (cost(at - h) - cost(at + h)) / (2 * h)
    assert value == pytest.approx(float(wanted), rel=1e-10)
    assert gradient[1] == pytest.approx(float(slope), rel=1e-8)


def test_memory_grows_with_the_number_of_samples():
    times = STEP * np.arange(5_000)
    posterior = posterior_at(Matern52(1.0, 2.0), times, 0.1)
    tracemalloc.start()
    posterior.negative_log_marginal_likelihood()
    posterior.jets(times[:10], 0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert isinstance(posterior._factored, Quasiseparable)
    assert peak < 500 * times.nbytes
