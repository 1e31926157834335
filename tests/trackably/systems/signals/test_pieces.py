"""Polynomial pieces are what SciPy says of the same numbers, whatever lies beyond them."""

import numpy as np
import pytest
from scipy.interpolate import Akima1DInterpolator, CubicSpline, PPoly

from trackably.systems.pieces import PolynomialPieces

TIMES = np.array([0.0, 0.7, 1.0, 2.5, 4.0])
VALUES = np.array([0.3, -1.0, 0.5, 0.2, 0.3])
PARTNERS = {
    "cubic": CubicSpline(TIMES, VALUES),
    "periodic": CubicSpline(TIMES, VALUES, bc_type="periodic"),
    "akima": Akima1DInterpolator(TIMES, VALUES),
    "steps": PPoly(np.array([[1.0, -2.0, 0.5, 3.0]]), TIMES),
    "quintic": PPoly(np.random.default_rng(0).standard_normal((6, 4)), TIMES),
}


def pieces(partner, beyond):
    return PolynomialPieces(partner.x, partner.c[::-1].T, beyond)


@pytest.mark.parametrize("name", PARTNERS)
def test_values_are_those_of_scipy(name):
    partner, t = PARTNERS[name], np.linspace(0, 3.99, 120).reshape(4, 30)
    assert pieces(partner, "end")(t) == pytest.approx(partner(t), rel=1e-12, abs=1e-11)


@pytest.mark.parametrize("name", PARTNERS)
def test_at_rest_a_signal_keeps_its_first_and_its_last_value(name):
    signal = pieces(PARTNERS[name], "rest")
    assert signal(np.array([-1e9, -1.0])) == pytest.approx(np.full(2, signal(0.0)))
    assert signal(np.array([4.0, 7.0, 1e9])) == pytest.approx(np.full(3, PARTNERS[name](4.0)))


@pytest.mark.parametrize(
    ("breakpoints", "coefficients", "beyond", "reason"),
    [
        ([0.0], [], "rest", "breakpoints must be two"),
        ([0.0, 1.0], [[1.0], [2.0]], "rest", r"got shape \(2, 1\)"),
        ([0.0, 1.0], [[np.inf]], "rest", "must be finite"),
        ([0.0, 1.0], [[1.0]], "for ever", "one of rest, period, end"),
        ([0.1, 1.3], [[1.0]], "period", "must be exact"),
    ],
)
def test_what_is_no_signal_is_refused_in_a_sentence(breakpoints, coefficients, beyond, reason):
    with pytest.raises(ValueError, match=reason):
        PolynomialPieces(breakpoints, coefficients, beyond)


@pytest.mark.parametrize("make", [PolynomialPieces.steps, PolynomialPieces.lines])
@pytest.mark.parametrize(
    ("values", "period", "error", "said"),
    [
        ({1.0: 0.0, 0.5: 1.0}, None, ValueError, "rising times"),
        ({0.0: 1.0, 0.5: "high"}, None, TypeError, "value: expected a number, got 'high'"),
        ([0.0, 1.0], None, TypeError, "expected values by their times"),
        ({0.0: 1.0, 0.5: 2.0}, 0.0, ValueError, "period must be positive, got 0"),
    ],
)
def test_values_by_time_are_numbers(make, values, period, error, said):
    with pytest.raises(error, match=f"^pieces: .*{said}"):
        make(values, period)
