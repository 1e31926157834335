from fractions import Fraction

import numpy as np
import pytest
from scipy.interpolate import PPoly

from benchmarks.rivals.judge.curves import PolynomialCurve
from benchmarks.rivals.judge.polynomials import Combination, Pieces, bernstein, halved, largest
from trackably.systems.intervals import Interval

_TOLERANCE = Fraction(1, 10**9)


def pieces(seed: int, count: int = 5, degree: int = 4) -> Pieces:
    rng = np.random.default_rng(seed)
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, count))])
    return Pieces.of(PPoly(rng.standard_normal((degree + 1, count)), breaks))


@pytest.mark.parametrize("seed", range(5))
def test_the_largest_value_is_enclosed_and_what_dense_times_show(seed):
    p = pieces(seed)
    found = largest(p, _TOLERANCE)
    ends = np.array([float(t) for t in p.breaks])
    seen = max(
        float(np.polynomial.polynomial.polyval(np.linspace(0, b - a, 4001), [float(c) for c in part]).max())
        for a, b, part in zip(ends[:-1], ends[1:], p.parts, strict=True)
    )
    assert found.most - found.least <= _TOLERANCE
    assert found.least <= found.most
    assert seen - 1e-6 <= float(found.most)
    assert float(found.least) <= seen + 1e-5


def test_what_hides_between_two_grid_points_is_found():
    # Zero at both ends and below −1 there, and 1/1000 above zero in the middle of a tenth.
    spike = Pieces((Fraction(0), Fraction(1, 10)), ((Fraction(-1), Fraction(4004, 100), Fraction(-40040, 100)),))
    assert largest(spike, _TOLERANCE).least > 0
    assert spike(np.array([0.0, 0.1])).max() < 0


def test_bernstein_coefficients_reproduce_the_polynomial_on_both_halves():
    part = tuple(map(Fraction, (1, -2, 3, 5)))
    left, right = halved(bernstein(part, Fraction(2)))
    assert left[0] == 1
    assert left[-1] == right[0] == sum(part)
    assert right[-1] == sum(a * 2**k for k, a in enumerate(part))


def test_a_combination_is_the_same_exactly_and_in_float64():
    p, q = pieces(1), pieces(2)
    of = Combination(((Fraction(2), p), (Fraction(-1, 3), q.shifted(Fraction(1, 8)))), Fraction(1))
    exact = of.within(Fraction(1, 4), Fraction(3, 2))
    for t in np.linspace(0.26, 1.49, 20).tolist():
        assert of.at(Fraction(t)) == exact.at(Fraction(t))
        assert float(of.at(Fraction(t))) == pytest.approx(of(np.array(t)), abs=1e-12)
        assert of.as_scipy(t) == pytest.approx(of(np.array(t)), abs=1e-12)


def test_a_curve_says_by_how_much_and_where_a_bound_is_broken():
    half = Pieces((Fraction(0), Fraction(1)), ((Fraction(0), Fraction(1), Fraction(-1)),))
    broken = PolynomialCurve((half,), (("x", Interval(-1.0, 0.125), half),)).violation((0.0, 1.0))
    kept = PolynomialCurve((half,), (("x", Interval(-1.0, 0.375), half),)).violation((0.0, 1.0))
    assert broken.least == pytest.approx(0.125 / 1.125, rel=1e-9)
    assert broken.least <= broken.most
    assert broken.time == 0.5
    assert kept.is_none
