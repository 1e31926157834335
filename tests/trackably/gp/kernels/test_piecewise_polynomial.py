"""Kernels with compact support: the general formula, and both ends of their polynomial."""

from fractions import Fraction
from math import factorial

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.gp.instances import compact, formula
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3

FAMILIES = {2: PiecewisePolynomial2, 3: PiecewisePolynomial3}

over_families = pytest.mark.parametrize(("q", "family"), FAMILIES.items())


@over_families
def test_the_polynomial_is_that_of_the_general_formula(q, family):
    """Equation (4.21) with j = ⌊D/2⌋ + q + 1 and D = 1, in rational numbers: equal at more points than its degree."""
    assert family.power == q + 1 + q
    for k in range(20):
        s = Fraction(k, 20)
        (value,) = [(1 - s) ** family.power * sum(int(c) * s**n for n, c in enumerate(family.polynomial.coef.tolist()))]
        assert value == compact(q, s)


@over_families
def test_derivatives_of_every_order_inside(q, family):
    kernel = family(1.0, 1.0)
    s = np.array([-0.93, -0.2, 0.04, 0.24, 0.5, 0.871])
    orders = family.power + q  # the degree: the last derivative is constant, and the next one zero
    found = kernel.jet(s, orders + 1)
    with mp.workdps(60):
        expected = np.array([[float(c) for c in mp.taylor(formula(kernel), mp.mpf(v), orders)] for v in s]).T
    expected *= np.array([float(factorial(n)) for n in range(orders + 1)])[:, None]
    scale = np.max(np.abs(expected), axis=1, keepdims=True)
    np.testing.assert_allclose(found[:-1] / scale, expected / scale, atol=1e-12)
    assert not np.any(found[-1])


@over_families
def test_small_values_keep_their_digits(q, family):
    """Near the end of the support, where (1 − s)ᵖ is tiny: nothing cancels."""
    kernel = family(1.0, 1.0)
    s = np.append(1 - 2.0 ** -np.arange(1, 50), np.linspace(0, 0.999, 300))
    with mp.workdps(60):
        expected = [float(formula(kernel)(mp.mpf(v))) for v in s]
        slopes = [float(mp.diff(formula(kernel), mp.mpf(v))) if v else 0.0 for v in s]
    jet = kernel.jet(s, 1)
    np.testing.assert_allclose(jet[0], expected, rtol=4e-15)
    np.testing.assert_allclose(jet[1], slopes, rtol=2e-14)
