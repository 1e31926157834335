"""Interpolation in Chebyshev points: exact for polynomials, and as many points as a covariance needs."""

import numpy as np
import pytest

from trackably.gp.factors.low_rank import ROUNDING, Bases
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential

EVENLY = np.linspace(0.0, 7.0, 400)


SMOOTH: list[Kernel] = [
    SquaredExponential(2.0, 0.5),
    SquaredExponential(0.1, 30.0),
    RationalQuadratic(1.0, 2.0, 1.5),
    Periodic(1.0, 0.8, 2.5),
]


@pytest.mark.parametrize("kernel", SMOOTH, ids=str)
def test_so_many_points_resolve_a_smooth_kernel(kernel):
    bases = Bases(EVENLY, np.ones(400), 7.0)
    count = bases.points_for(kernel.value_and_gradient, 200)
    assert count
    basis = bases.of(count)
    w = basis.q @ basis.r
    for between, exact in zip(
        _both(kernel, basis.points[:, None] - basis.points), _both(kernel, EVENLY[:, None] - EVENLY), strict=True
    ):
        assert np.max(np.abs(w @ between @ w.T - exact)) < 20 * ROUNDING * np.max(np.abs(exact))


@pytest.mark.parametrize("kernel", [Matern32(1.0, 5.0), Matern52(1.0, 5.0), SquaredExponential(1.0, 0.01)], ids=str)
def test_no_number_of_points_is_enough_for_others(kernel):
    assert Bases(EVENLY, np.ones(400), 7.0).points_for(kernel.value_and_gradient, 200) is None


@pytest.mark.parametrize("waves", [120, 127, 130, 200, 255, 257, 400])
def test_what_folds_back_onto_few_points_is_not_taken_for_resolved(waves):
    def cosine(r):
        values = np.cos(2 * np.pi * waves / EVENLY[-1] * r)
        return values, values[None]

    assert Bases(EVENLY, np.ones(400), 7.0).points_for(cosine, 256) is None


def _both(kernel, r):
    value, gradient = kernel.value_and_gradient(r)
    return [value, *gradient]
