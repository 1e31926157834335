"""Convert curves to polynomial pieces: splines of SciPy, interpolated samples, trajectories of python-control."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from reprlib import repr as short
from typing import Any, Literal, get_args

import numpy as np
from numpy.polynomial.polynomial import polyfit, polyval
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

_DEFAULT_END = 1.0  # s: T of a basis of python-control, if none is given
_MISSED = 1e-9  # states count as polynomials if a fit misses their values by at most this part of the largest value


def is_flat_trajectory(given: Any) -> bool:
    """Return whether an object has the attributes of a `control.flatsys.SystemTrajectory`."""
    return all(hasattr(given, name) for name in ("basis", "coeffs", "flaglen", "eval"))


def states_as_pieces(given: Any, span: tuple[float, float] | None) -> list[PolynomialPieces]:
    """Return all states of a flat trajectory of python-control as pieces, from the start to the end of its basis.

    A basis begins at its first breakpoint, or at 0. If it has no breakpoints, and T is the default, 1 s, the end of the
    trajectory is unknown, and the polynomials are used on the claimed `span` [s].

    ValueError: states are no polynomials, because the system is not linear, or a span is needed but missing.
    """
    ends = np.unique(_ends(given.basis, span))
    nodes = np.cos(np.pi * np.arange(2 * given.basis.N + 1) / (2 * given.basis.N))[::-1] / 2 + 0.5
    rows = [_fit_pieces(given, start, end, nodes) for start, end in pairwise(ends.tolist())]
    return [PolynomialPieces(ends, [row[i] for row in rows], "end") for i in range(given.nstates)]


def _ends(basis: Any, span: tuple[float, float] | None) -> Sequence[float]:
    """Return the breakpoints of a basis; if it has none, the first and the last time [s]."""
    if hasattr(basis, "breakpoints"):
        return list(basis.breakpoints)
    end = float(getattr(basis, "T", _DEFAULT_END))
    if end != _DEFAULT_END:
        return 0.0, end
    if span is None:
        raise ValueError(
            "trajectory: python-control keeps no times, and the T of this basis is the default, 1 s; give a claim from "
            "start to end, as (0.0, 3.0), or make the trajectory with its last time, as PolyFamily(6, T=3.0)"
        )
    return span


def _fit_pieces(given: Any, start: float, end: float, nodes: Array) -> Array:
    """Fit polynomials to the states at `nodes` in [0, 1] from start to end; return coefficients (n, degree + 1)."""
    width, inside = end - start, 1e-9  # times stay inside, as the last point of a piece belongs to the next one
    x = nodes * (1 - inside)
    values = np.asarray(given.eval(start + width * x)[0], dtype=float)
    degree = int(np.max(getattr(given.basis, "degree", given.basis.N - 1)))
    found = polyfit(x, values.T, degree)
    missed, size = np.max(np.abs(polyval(x, found) - values)), np.max(np.abs(values))
    if not missed <= _MISSED * max(float(size), 1e-30):
        raise ValueError(
            f"trajectory: expected states that are polynomials of degree {degree}, as those of a linear system, but "
            f"they differ from such polynomials by {missed:.3g}"
        )
    return np.asarray(found.T / width ** np.arange(degree + 1))


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
    "PolynomialPieces, a flat trajectory of python-control, or samples with interpolation="
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
    except ValueError:  # the only reason that is left
        raise ValueError(
            f"interpolation: {how} of a periodic curve needs the first value, {values[0]:.10g} at {times[0]:.10g} s, "
            f"again at the end of the period, got {values[-1]:.10g} at {times[-1]:.10g} s"
        ) from None
