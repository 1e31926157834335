"""Derivatives in time and in the hyperparameters, against 40-digit differentiation of formulas written twice."""

import math

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.gp import naive
from tests.trackably.gp.instances import KERNELS, formula, over, time_scale, time_scales
from trackably import RationalQuadratic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.gp.prior import Prior

RELATIVE_TIMES = np.array([-2.7, -0.9, -0.31, 0.013, 0.5, 0.77, 1.6, 3.3])


def in_units_of(reference, array):
    """Each derivative (axis −2) as a part of its own largest magnitude."""
    return array / np.max(np.abs(reference), axis=-1, keepdims=True, initial=1e-300)


@over(KERNELS)
def test_value_and_derivatives_against_forty_digits(kernel):
    r = RELATIVE_TIMES * time_scale(kernel)
    with mp.workdps(40):
        f = formula(kernel)
        exact = np.array([[float(mp.diff(f, mp.mpf(t), n)) for t in r.tolist()] for n in range(7)])
    np.testing.assert_allclose(in_units_of(exact, kernel.jet(r, 6)), in_units_of(exact, exact), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(kernel(r), exact[0], rtol=2e-12)


@over(KERNELS)
def test_at_zero_a_kernel_is_the_parabola_of_its_correlation_time(kernel):
    """κ(r) ≈ κ(0) (1 − r²/(2 τ²)) for small r; with many length scales τ is that of the parabola of κ̈."""
    step = 1e-3 * min(time_scales(kernel))
    (value, near), (slope, _), (curvature, bent) = kernel.jet(np.array([0.0, step]), 2)
    parabola = step / math.sqrt(2 * (1 - near / value))
    assert slope == pytest.approx(0, abs=1e-12 * math.sqrt(-curvature))
    assert math.sqrt(-value / curvature) == pytest.approx(parabola, rel=3e-3)
    if isinstance(kernel, RationalQuadratic):
        parabola = step * math.sqrt(1.5 / (1 - bent / curvature))
    assert kernel.correlation_time == pytest.approx(parabola, rel=3e-3)


@over(KERNELS)
@pytest.mark.parametrize("order", [0, 1, 2])
def test_gradient_against_central_differences(kernel, order):
    r = np.append(0.0, RELATIVE_TIMES) * time_scale(kernel)
    jet, gradient = kernel.jet_and_gradient(r, order)
    np.testing.assert_allclose(jet, kernel.jet(r, order), rtol=1e-13 if order == 0 else 0, atol=1e-300)
    reference = naive.by_log_hyperparameters(lambda at: at.kernel.jet(r, order), Prior(kernel.as_learned(), 1.0))
    np.testing.assert_allclose(in_units_of(jet, gradient), in_units_of(jet, reference), rtol=1e-6, atol=2e-8)


@pytest.mark.parametrize("family", [PiecewisePolynomial2, PiecewisePolynomial3])
def test_values_near_the_end_of_a_support_keep_their_digits(family):
    """Where (1 − s)ᵖ is tiny, nothing cancels."""
    kernel, s = family(1.0, 1.0), np.append(1 - 2.0 ** -np.arange(1, 50), np.linspace(0.01, 0.999, 50))
    with mp.workdps(60):
        exact = [[float(mp.diff(formula(kernel), mp.mpf(t), n)) for t in s.tolist()] for n in range(2)]
    np.testing.assert_allclose(kernel.jet(s, 1), exact, rtol=2e-14)
