"""Convert curves to polynomial pieces: splines of SciPy, and interpolated samples."""

from collections.abc import Callable
from functools import partial
from reprlib import repr as short
from typing import Any, Literal, get_args

import numpy as np
from scipy.interpolate import (
    Akima1DInterpolator,
    BSpline,
    CubicSpline,
    PchipInterpolator,
    UnivariateSpline,
    make_interp_spline,
)

from trackably.arguments import numbers
from trackably.arrays import Array
from trackably.checker import polynomials
from trackably.checker.subject import Beyond
from trackably.given.table import Table
from trackably.gp.samples import Samples
from trackably.systems.pieces import PolynomialPieces, is_spline


def shift(c: Array, by: Array | float) -> Array:
    """Return the coefficients of p(t + by), given those of p(t) along the last axis of c.

    `by` is a number, or an array whose shape fits the other axes of c.
    """
    by_power = [*np.moveaxis(c, -1, 0).copy()]
    return np.stack(polynomials.shift(by_power, by), axis=-1)


Interpolation = Literal["linear", "cubic", "quintic", "pchip", "akima"]
"""How samples are joined: by straight lines, splines of degree 3 or 5, or cubic pieces with slopes from neighbours."""

_FREE_QUINTIC = 6  # fewest samples without conditions at the ends, as a polynomial of degree 5 has 6 coefficients

_ACCEPTED = (
    "a spline of SciPy (PPoly, CubicSpline, Akima1DInterpolator, PchipInterpolator, BSpline, BPoly, UnivariateSpline), "
    "PolynomialPieces, or samples with interpolation="
)


def repeats(given: Any) -> bool:
    """Return whether a curve is marked as periodic."""
    if isinstance(given, PolynomialPieces):
        return given.beyond == "period"
    return getattr(given, "extrapolate", None) == "periodic"


def as_pieces(
    given: Any, beyond: Beyond, interpolation: Interpolation | None = None, step: float | None = None
) -> PolynomialPieces:
    """Convert a curve to polynomial pieces, which go `beyond` their last breakpoint as `PolynomialPieces` describes.

    `given` is a spline of SciPy, PolynomialPieces, or samples, which need an `interpolation`: Samples, or an array of
    values from t = 0 on, `step` [s] apart. Proofs are about the float64 coefficients of the pieces. Coefficients of
    B-splines are computed from the given ones, with rounding errors.

    TypeError: `given` is none of these. ValueError: a curve has several values at a time, samples have no known
    interpolation, or breakpoints decrease or are NaN.
    """
    if isinstance(given, PolynomialPieces):
        return PolynomialPieces(given.breakpoints, given.coefficients, beyond)
    if isinstance(given, UnivariateSpline):
        given = BSpline(*vars(given)["_eval_args"])
    if not is_spline(given):
        times, values = _samples(given, step)
        given = interpolate(times, values, interpolation, beyond)
    return PolynomialPieces.of_spline(given, beyond)


def _samples(given: Any, step: float | None) -> tuple[Array, Array]:
    if isinstance(given, Samples):
        return given.times, given.values
    if isinstance(given, Table):
        raise TypeError("trajectory: expected a curve, got a Table; certify_table proves tables, at their steps")
    if callable(given) or isinstance(given, str):
        raise TypeError(f"trajectory: expected {_ACCEPTED}, got {short(given)}")
    values = numbers("trajectory", given)
    if values.ndim != 1 or step is None:
        raise TypeError(f"trajectory: expected {_ACCEPTED}, got an array of shape {values.shape}")
    return _samples(Samples(np.arange(len(values), dtype=float) * step, values), step)


def interpolate(times: Array, values: Array, how: Interpolation | None, beyond: Beyond) -> Any:
    """Return the interpolation of samples at `times` [s], as a spline of SciPy.

    At their ends, splines are clamped (`beyond` is "rest"), periodic ("period") or not-a-knot ("end").

    ValueError: the interpolation is unknown or None, there are too few samples for it, or the first and the last sample
    of a periodic curve differ.
    """
    if how is None or how not in get_args(Interpolation):
        raise ValueError(f"interpolation: samples need one of {', '.join(get_args(Interpolation))}, got {how!r}")
    if len(values) < (fewest := _FREE_QUINTIC if (how, beyond) == ("quintic", "end") else 2):
        raise ValueError(f"interpolation: {how} needs {fewest} samples at least, got {len(values)}")
    flat: Any = [(1, 0.0), (2, 0.0)]
    cubic, quintic = {
        "rest": ("clamped", (flat, flat)),
        "period": ("periodic", "periodic"),
        "end": ("not-a-knot", None),
    }[beyond]
    makers: dict[str, Callable[..., Any]] = {
        "linear": partial(make_interp_spline, k=1),
        "cubic": partial(CubicSpline, bc_type=cubic),
        "quintic": partial(make_interp_spline, k=5, bc_type=quintic),
        "pchip": PchipInterpolator,
        "akima": Akima1DInterpolator,
    }
    try:
        return makers[how](times, values)
    except ValueError as error:  # an error of SciPy, for example if the ends of a periodic curve differ
        raise ValueError(f"interpolation: {how} of {len(values)} samples: {error}") from error
