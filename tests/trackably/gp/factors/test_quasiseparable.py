"""Samples in blocks: against fifty digits, and in little memory."""

import tracemalloc

import mpmath
import numpy as np
import pytest

from tests.trackably.gp.factors.factors import posterior_at, with_factor
from tests.trackably.gp.instances import formula
from trackably.gp.factorise import noise_variance, terms_of
from trackably.gp.factors.quasiseparable import Quasiseparable, blocks, row_blocks
from trackably.gp.kernels.matern import Matern52

STEP = 0.1


def test_digits_of_slow_processes_are_those_of_the_samples():
    """Samples that are dense beside the correlation time, in fifty digits: −2 ln p and its gradient."""
    posterior = posterior_at(Matern52(4.0, 70.0), STEP * np.arange(24), 0.025)
    samples, kernel = posterior.samples, posterior.prior.kernel
    sevens = blocks(samples.times, 0.0, 7)
    found = row_blocks(terms_of(samples), sevens, kernel.decays)
    factor = Quasiseparable.of(found, noise_variance(posterior.prior, samples))
    value, gradient = with_factor(posterior, factor).negative_log_marginal_likelihood()
    with mpmath.workdps(50):
        t, kappa, h = [*map(mpmath.mpf, samples.times.tolist())], formula(kernel), mpmath.mpf(10) ** -20
        y = mpmath.matrix([mpmath.mpf(each) - posterior.prior.mean for each in samples.values.tolist()])
        noise = mpmath.mpf(posterior.prior.noise_std) ** 2 * mpmath.eye(len(t))

        def cost(stretch):
            k = mpmath.matrix([[kappa((one - other) / stretch) for other in t] for one in t]) + noise
            return (y.T * mpmath.lu_solve(k, y))[0] + mpmath.log(mpmath.det(2 * mpmath.pi * k))

        wanted, slope = cost(1), (cost(1 + h) - cost(1 - h)) / (2 * h)
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
