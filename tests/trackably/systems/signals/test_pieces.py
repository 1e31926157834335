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


@pytest.mark.parametrize("name", PARTNERS)
def test_values_are_those_of_scipy(name):
    partner, t = PARTNERS[name], np.linspace(0, 3.99, 120).reshape(4, 30)
    signal = PolynomialPieces(partner.x, partner.c[::-1].T, "end")
    assert signal(t) == pytest.approx(partner(t), rel=1e-12, abs=1e-11)


LATER = {0.0: 1.0, 0.5: 2.0}
REFUSED = {
    "one breakpoint": (lambda: PolynomialPieces([0.0], []), ValueError, "breakpoints must be two"),
    "other shapes": (lambda: PolynomialPieces([0.0, 1.0], [[1.0], [2.0]]), ValueError, r"got shape \(2, 1\)"),
    "infinite": (lambda: PolynomialPieces([0.0, 1.0], [[np.inf]]), ValueError, "must be finite"),
    "beyond": (lambda: PolynomialPieces([0.0, 1.0], [[1.0]], "for ever"), ValueError, "one of rest, period, end"),
    "no exact period": (lambda: PolynomialPieces([0.1, 1.3], [[1.0]], "period"), ValueError, "must be exact"),
    "falling": (lambda: PolynomialPieces.steps({1.0: 0.0, 0.5: 1.0}), ValueError, "rising times"),
    "a text": (lambda: PolynomialPieces.lines({0.0: "high"}), TypeError, "value: expected a number, got 'high'"),
    "a list": (lambda: PolynomialPieces.steps([0.0, 1.0]), TypeError, "expected values by their times"),
    "no period": (lambda: PolynomialPieces.lines(LATER, 0.0), ValueError, "period must be positive, got 0"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_signal_is_refused_in_a_sentence(name):
    make, error, said = REFUSED[name]
    with pytest.raises(error, match=f"^pieces: .*{said}"):
        make()
