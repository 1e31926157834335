"""Convert curves to polynomial pieces."""

from reprlib import repr as short
from typing import Any

import numpy as np
from scipy.interpolate import BSpline, UnivariateSpline

from trackably.arrays import Array
from trackably.checker import polynomials
from trackably.checker.subject import Beyond
from trackably.systems.pieces import PolynomialPieces, is_spline


def shift(c: Array, by: Array | float) -> Array:
    """Return the coefficients of p(t + by), given those of p(t) along the last axis of c.

    `by` is a number, or an array whose shape fits the other axes of c.
    """
    by_power = [*np.moveaxis(c, -1, 0).copy()]
    return np.stack(polynomials.shift(by_power, by), axis=-1)


_ACCEPTED = (
    "a spline of SciPy (PPoly, CubicSpline, Akima1DInterpolator, PchipInterpolator, BSpline, BPoly, UnivariateSpline), "
    "or PolynomialPieces (points are joined by a spline, as CubicSpline(times, values); certify_table proves tables)"
)


def repeats(given: Any) -> bool:
    """Return whether a curve is marked as periodic."""
    if isinstance(given, PolynomialPieces):
        return given.beyond == "period"
    return getattr(given, "extrapolate", None) == "periodic"


def as_pieces(given: Any, beyond: Beyond) -> PolynomialPieces:
    """Convert a curve to polynomial pieces, which go `beyond` their last breakpoint as `PolynomialPieces` describes.

    `given` is a spline of SciPy, or PolynomialPieces. Proofs are about the float64 coefficients of the pieces.
    Coefficients of B-splines are computed from the given ones, with rounding errors.

    TypeError: `given` is none of these. ValueError: a curve has several values at a time, or breakpoints decrease or
    are NaN.
    """
    if isinstance(given, PolynomialPieces):
        return PolynomialPieces(given.breakpoints, given.coefficients, beyond)
    if isinstance(given, UnivariateSpline):
        given = BSpline(*vars(given)["_eval_args"])
    if not is_spline(given):
        raise TypeError(f"trajectory: expected {_ACCEPTED}, got {short(given)}")
    return PolynomialPieces.of_spline(given, beyond)
