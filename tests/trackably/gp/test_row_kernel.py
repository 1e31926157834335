"""Covariances of rows: against sums with many digits, where differences of float64 have none left."""

import tracemalloc

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.gp.instances import KERNELS, formula, over, time_scales
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.rows import RowKernel, Terms, row_kernel

DIGITS = 50
ANALYTIC = {name: kernel for name, kernel in KERNELS.items() if kernel.is_analytic}
DIFFERENCES = ((1.0,), (-1.0, 1.0), (1.0, -2.0, 1.0), (0.3, 0.5, -0.4, 0.6))
COUNT = 9


def rows(kernel: Kernel, step: float) -> Terms:
    """Values, difference quotients and sums, two of each at random times; the last row has no terms."""
    scale = min(time_scales(kernel))
    times, h = np.random.default_rng(0).uniform(0, 3 * scale, 8), step * scale
    parts = []
    for a, t in enumerate(times.tolist()):
        weights = np.array(DIFFERENCES[a % 4])
        order = len(weights) - 1 if a % 4 < 3 else 0
        parts.append(Terms(t + h * np.arange(len(weights)), weights / h**order, np.full(len(weights), a)))
    return Terms.joined(parts)


def with_many_digits(kernel: Kernel, terms: Terms, others: Terms, count: int) -> np.ndarray:
    with mp.workdps(DIGITS):
        kappa, found = formula(kernel), mp.zeros(COUNT, count)
        for s, v, a in zip(terms.times, terms.weights, terms.of_row.tolist(), strict=True):
            for t, w, b in zip(others.times, others.weights, others.of_row.tolist(), strict=True):
                found[a, b] += mp.mpf(v) * mp.mpf(w) * kappa(mp.mpf(s) - mp.mpf(t))
        return np.array(found.tolist(), dtype=float)


def assert_are_those_with_many_digits(kernel: Kernel, step: float, tolerance: float) -> RowKernel:
    """Up to a tolerance in units of the rows' standard deviations."""
    terms = rows(kernel, step)
    exact, found = with_many_digits(kernel, terms, terms, COUNT), row_kernel(kernel, terms, COUNT)
    size = np.sqrt(np.diag(exact))  # 0 of the last row, whose covariances are exactly that
    assert np.all(np.abs(found.among() - exact) <= tolerance * np.outer(size, size))
    assert np.all(found.rounding <= tolerance * size**2)
    times = np.linspace(-1, 4, 4) * min(time_scales(kernel))
    exact = with_many_digits(kernel, terms, Terms(times, np.ones(4), np.arange(4)), 4)
    scale = size[:, None] * np.sqrt(kernel(np.zeros(())))
    assert np.all(np.abs(found.across(times) - exact) <= tolerance * scale)
    return found


@over(KERNELS)
def test_covariances_are_those_with_many_digits(kernel):
    assert_are_those_with_many_digits(kernel, 0.3, 1e-10)


@over(ANALYTIC)
def test_covariances_of_short_differences_too(kernel):
    assert_are_those_with_many_digits(kernel, 1e-2, 1e-8)
    assert assert_are_those_with_many_digits(kernel, 1e-3, 1e-10).moments.shape[1] > 1  # a series


@pytest.mark.parametrize("kernel", [Matern32(1.3, 2.0), Matern52(0.7, 5.0)], ids=str)
def test_gradients_of_many_rows_come_from_moments(kernel):
    """Second differences at random times of a long while, not sorted: as many as moments need."""
    rng, h = np.random.default_rng(7), 0.1
    first, multipliers = rng.uniform(0.0, 300.0, 200), rng.normal(size=200)
    parts = [Terms(first + j * h, np.full(200, w / h**2), np.arange(200)) for j, w in enumerate(DIFFERENCES[2])]
    terms, times, weights = Terms.joined(parts), rng.uniform(-20.0, 320.0, 500), rng.normal(size=500)
    found, u = row_kernel(kernel.as_learned(), terms, 200), terms.spread(multipliers)

    def direct(t, w):
        return kernel.value_and_gradient(terms.times[:, None] - t)[1] @ w @ u

    one, other = found.energy_gradient(multipliers, times, weights), 2 * direct(times, weights) + direct(terms.times, u)
    np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-9 * np.max(np.abs(other)))


def test_memory_is_that_of_the_covariances_alone():
    """Those of all terms would take several times as much."""
    starts, times = np.linspace(0.0, 90.0, 400), np.linspace(0.0, 100.0, 4000)
    terms = Terms(np.append(starts, starts + 1.0), np.append(np.ones(400), -np.ones(400)), np.tile(np.arange(400), 2))
    kernel = row_kernel(Matern52(1.0, 0.3), terms, 400)
    tracemalloc.start()
    found = kernel.across(times)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3 * found.nbytes
