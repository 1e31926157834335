"""Kernels with compact support: the general formula, both ends of their polynomial, and exact zeros beyond."""

from fractions import Fraction
from math import factorial

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.gp.instances import compact, formula
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3

FAMILIES = {2: PiecewisePolynomial2, 3: PiecewisePolynomial3}
LENGTHS = (1.0, 0.3, 7.1, 1e-9, 1e9)

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
@pytest.mark.parametrize("length", LENGTHS)
def test_beyond_the_support_there_are_zeros_only(q, family, length):
    """From θ₂ itself on while the derivative is continuous there, and right beyond it for every other."""
    kernel = family(2.0, length)
    assert kernel.vanishing_distance == length
    for sign in (-1, 1):
        at = sign * length * np.array([1.0, 1.5, 1e3, 1e200])
        assert not np.any(kernel.jet(at, 2 * q))
        later = sign * np.array([np.nextafter(length, np.inf), 2 * length, 1e290])
        assert not np.any(kernel.jet(later, 3 * q + 4))
        assert not np.any(kernel.jet_and_gradient(later, 2 * q)[1])
        assert kernel(np.array(sign * length * (1 - 2**-40))) > 0


@over_families
def test_a_derivative_that_jumps_has_its_midpoint_there(q, family):
    """φ⁽²q⁺¹⁾ jumps at 0, from minus to plus, and where the support ends, from its last value to zero."""
    kernel, n = family(1.0, 1.0), 2 * q + 1
    zero, end, right_before, right_after = kernel.jet(np.array([0.0, 1.0, 1 - 1e-12, 1 + 1e-12]), n)[n]
    assert zero == 0
    assert right_after == 0
    assert right_before == pytest.approx({2: -14 * 120, 3: -48 * 5040}[q], rel=1e-9)
    assert end == pytest.approx(right_before / 2, rel=1e-9)
    assert kernel.jet(np.array(-1.0), n)[n] == -end
    assert kernel.jet(np.array(1e-12), n)[n] == -kernel.jet(np.array(-1e-12), n)[n] != 0
    for m in range(1, n):  # all others are continuous
        jet = kernel.jet(np.array([-1e-9, 0.0, 1e-9, 1 - 1e-9, 1 + 1e-9]), m)[m]
        assert np.max(np.abs(np.diff(jet[:3]))) < 1e-2
        assert np.max(np.abs(np.diff(jet[3:]))) < 1e-2


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


@over_families
def test_the_spectrum_is_positive(q, family):
    """Bochner's theorem: S(ω) = 2 ∫₀¹ φ(s) cos ωs ds > 0. One power of 1 − s less, and it is not."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    s = (nodes + 1) / 2
    cosines = np.cos(np.outer(np.linspace(0, 150, 2000), s)) * weights
    spectrum = cosines @ family(1.0, 1.0)(s)
    assert np.min(spectrum) > 0
    assert np.min(cosines @ (family(1.0, 1.0)(s) / (1 - s) ** 2)) < 0
