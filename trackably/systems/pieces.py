"""Piecewise polynomials of time, evaluated in twice the precision of float64: signals of references that are given.

Signals of learned references are sums of kernels (`gp.signal`). Bounds that move in time are piecewise polynomials,
too.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import pairwise
from math import factorial
from operator import add
from reprlib import repr as short
from typing import TYPE_CHECKING, Any, Self, TypeGuard, get_args

import numpy as np
import numpy.typing as npt
import scipy

from trackably.arguments import array, instance, positive, real
from trackably.arrays import Array, ArrayLike
from trackably.checker.subject import Beyond, Pieces
from trackably.gp.signal import KernelSum

if TYPE_CHECKING:
    from scipy.interpolate import BPoly, BSpline, PPoly

# Numbers of twice the precision of float64: unevaluated sums of two float64, elementwise in arrays.
#
# Sums and products are those of Dekker, "A floating-point technique for extending the available precision" (1971).
# Their errors are bounded by Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic building blocks of
# double-word arithmetic" (2017): with u = 2⁻⁵³, they are less than 8 u² of |x y| in a product, and of |x| + |y| in a
# sum. Numbers must neither overflow nor underflow. NumPy rounds each operation by itself, without fused
# multiplications.

_SPLITTER = 2.0**27 + 1


@dataclass(frozen=True, eq=False)
class DoubleDouble:
    """The number `high` + `low`, of which `high` is the nearest float64."""

    high: Array
    low: Array

    @classmethod
    def of(cls, number: Fraction) -> Self:
        """Convert a rational number, with a relative error of at most u², u = 2⁻⁵³."""
        high = float(number)
        return cls(np.asarray(high), np.asarray(float(number - Fraction(high))))

    def __add__(self, other: DoubleDouble) -> DoubleDouble:
        high, error = two_sum(self.high, other.high)
        low, smaller = two_sum(self.low, other.low)
        high, error = _two_sum_ordered(high, error + low)
        return DoubleDouble(*_two_sum_ordered(high, error + smaller))

    def __mul__(self, other: DoubleDouble) -> DoubleDouble:
        product, error = two_product(self.high, other.high)
        return DoubleDouble(*_two_sum_ordered(product, error + (self.high * other.low + self.low * other.high)))


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Return s = fl(a + b), the sum rounded to float64, and its rounding error a + b − s, which is a float64."""
    total = a + b
    of_b = total - a
    return total, (a - (total - of_b)) + (b - of_b)


def _two_sum_ordered(a: Array, b: Array) -> tuple[Array, Array]:
    """Return a + b rounded to float64, and the rounding error, as `two_sum` does, for |a| ≥ |b| or a = 0."""
    total = a + b
    return total, b - (total - a)


def two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """Return p = fl(a b), the product rounded to float64, and its rounding error a b − p, which is a float64."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def moved_back(time: Sequence[Array], period: float) -> Array:
    """Return times [s] moved by whole periods to around 0. `time` is one float64, or a sum of two from `two_product`.

    Let t be the first float64 of the time, n the number of whole periods nearest to it, and p = fl(n `period`). Then
    t − p is exact by Sterbenz's lemma, as p is 0 or between t/2 and 2 t. The rounding errors of t and p are at most
    u = 2⁻⁵³ times t and p, and their difference is added to t − p. So up to 2⁴⁰ periods the result is at most 0.501
    periods from 0, and within 0.502 u periods of the exact value. Times within half a period are not moved, only
    rounded.
    """
    high, *low = time
    whole, rest = two_product(np.rint(high / period), np.asarray(period))
    return np.asarray((high - whole) + (sum(low) - rest))


def _halves(a: Array) -> tuple[Array, Array]:
    """Split a float64 into a high and a low half: two numbers of at most 26 bits whose sum is a."""
    scaled = _SPLITTER * a
    high = scaled - (scaled - a)
    return high, a - high


# Sums of a few float64 without any rounding, elementwise in arrays, to compare and subtract times.


@dataclass(frozen=True, eq=False)
class ExactSum:
    """The exact sum of `parts`, the largest one last: an expansion in the sense of Shewchuk (1997).

    If it is built from one float64 by adding one term after the other, the binary digits of any two parts are separated
    by at least one zero digit. So all smaller parts together are less than half of the largest one.
    """

    parts: tuple[Array, ...]

    @classmethod
    def of(cls, terms: Iterable[Array]) -> Self:
        """Return the exact sum of float64 numbers."""
        return reduce(add, terms, cls(()))

    def __add__(self, term: Array) -> Self:
        found, total = [], term
        for part in self.parts:
            total, error = two_sum(total, part)
            found.append(error)
        return type(self)((*found, total))

    @property
    def rounded(self) -> Array:
        """The sum in float64, with the right sign; the relative error is at most 8 u = 2⁻⁵⁰ for up to eight parts."""
        return reduce(add, self.parts)

    @property
    def double_double(self) -> DoubleDouble:
        """The sum in twice the precision: its relative error is at most 80 u², u = 2⁻⁵³, for at most seven parts."""
        near = self.rounded
        return DoubleDouble(*two_sum(near, (self + -near).rounded))

    def turned_back(self, count: Array, period: Array) -> Self:
        """Return the sum minus `count` times the `period`, exactly."""
        whole, rest = two_product(count, period)
        return self + -whole + -rest

    def replace(self, where: npt.NDArray[np.bool_], value: float) -> Self:
        """Return the sums, replaced by `value` at the entries at which the mask `where` is true."""
        *others, last = (np.where(where, 0.0, part) for part in self.parts)
        return type(self)((*others, np.where(where, value, last)))


# A piecewise polynomial signal, as plain stored numbers: any spline is one.


@dataclass(frozen=True, eq=False)
class PolynomialPieces:
    """z(t) = Σ_j c_ij (t − t_i)^j for t_i ≤ t < t_(i+1), with `breakpoints` t_i [s] and `coefficients` c_ij.

    Shapes (n + 1,) and (n, degree + 1). The stored float64 numbers are exact, and z may jump at breakpoints. `beyond`
    defines z before t_0 and after t_n: with "rest", it keeps the value z(t_0) and the limit of z at t_n; with "period",
    it repeats every t_n − t_0; with "end", it is known between t_0 and t_n only. With "end", evaluation continues the
    first and the last piece, so that rounding of t at an end does no harm.

    ValueError: breakpoints do not increase, shapes do not fit, a number is not finite, or the period is no float64.
    """

    breakpoints: Array
    coefficients: Array
    beyond: Beyond

    def __init__(self, breakpoints: ArrayLike, coefficients: ArrayLike, beyond: Beyond = "rest") -> None:
        ends = increasing("pieces: breakpoints", breakpoints)
        c = array("pieces: coefficients", coefficients, len(ends) - 1, None)
        if beyond not in get_args(Beyond):
            raise ValueError(f"pieces: beyond must be one of {', '.join(get_args(Beyond))}, got {beyond!r}")
        vars(self).update(breakpoints=ends, coefficients=c, beyond=beyond)
        if beyond == "period" and Fraction(self.period) != Fraction(ends[-1]) - Fraction(ends[0]):
            raise ValueError(
                f"pieces: the period, from {ends[0]!r} s to {ends[-1]!r} s, must be exact in float64, but is rounded; "
                "let the first breakpoint be 0"
            )

    @classmethod
    def steps(cls, values: Mapping[float, float], period: float | None = None) -> Self:
        """Return a step function with these `values` by time [s], each of which holds until the next one.

        With a `period` [s], the last value holds until one period after the first time, and the whole repeats.
        """
        times, levels, beyond = _table(values, period)
        end = times[0] + period if period else times[-1] + 1.0
        return cls([*times, end], [[level] for level in levels], beyond)

    @classmethod
    def lines(cls, values: Mapping[float, float], period: float | None = None) -> Self:
        """Return straight lines between the `values`, given by time [s]; constant before the first and after the last.

        With a `period` [s], a line leads from the last value to the first one, one period after its time.
        """
        times, levels, beyond = _table(values, period)
        if period and (times[-1], levels[-1]) != (times[0] + period, levels[0]):
            times, levels = [*times, times[0] + period], [*levels, levels[0]]
        with np.errstate(all="ignore"):  # slopes that are not finite, or times that do not increase, are refused
            slopes = np.diff(levels) / np.diff(times)
        return cls(times, np.column_stack([levels[:-1], slopes]), beyond)

    @classmethod
    def from_mapping(cls, written: Mapping[Any, Any]) -> Self:
        """Return the pieces that a file describes: {0.0: 0.05, 2.5: 0.08}, {steps: …} or {lines: …}, and a `period`.

        The first form means steps. Keys may be texts, as in JSON. ValueError: `written` has none of these forms.
        TypeError: a value or the period is no number.
        """
        makers = {"steps": cls.steps, "lines": cls.lines}
        (kind, *others) = [name for name in makers if name in written] or ["steps"]
        given = written.get(kind, written)
        if others or not isinstance(given, Mapping) or (given is not written and written.keys() - {kind, "period"}):
            raise ValueError(
                "expected values by their times [s], as {0.0: 0.05, 2.5: 0.08}, or these under `steps` or `lines`, "
                f"with a `period` if they repeat, got {written}"
            )
        values = {float(t) if isinstance(t, str) else t: value for t, value in given.items()}
        return makers[kind](values, written.get("period") if given is not written else None)

    @classmethod
    def of_spline(cls, given: PPoly | BPoly | BSpline, beyond: Beyond) -> Self:
        """Return the pieces of a spline of SciPy.

        ValueError: as `pieces_of_spline`, or it has several values at a time.
        """
        ends, c = pieces_of_spline(given)
        if c.ndim != 2:
            raise ValueError(
                f"spline: expected one number at each time, got arrays of shape {c.shape[2:]}; give one curve for each "
                "number"
            )
        return cls(ends, c.T, beyond)

    @property
    def degree(self) -> int:
        """The degree of the pieces; higher coefficients may be zero."""
        return int(self.coefficients.shape[1]) - 1

    @property
    def period(self) -> float:
        """The length of time [s] from the first breakpoint to the last."""
        return float(self.breakpoints[-1] - self.breakpoints[0])

    def breakpoints_in(self, start: float, end: float) -> Array:
        """Return the breakpoints between `start` and `end` [s], and some beyond.

        Those of other periods than the first are rounded to float64; their neighbours in float64 are included.
        """
        if self.beyond != "period":
            return self.breakpoints
        first, last = self.breakpoints[[0, -1]]
        turns = np.arange(np.floor((start - last) / self.period), np.ceil((end - first) / self.period) + 1)
        repeated = np.add.outer(turns[turns != 0] * self.period, self.breakpoints[:-1]).ravel()
        beside = [np.nextafter(repeated, -np.inf), np.nextafter(repeated, np.inf)]
        return np.concatenate([self.breakpoints, repeated, *beside])

    @property
    def checked(self) -> Pieces:
        """The same pieces as an object of the checker's class."""
        return Pieces(tuple(self.breakpoints.tolist()), tuple(map(tuple, self.coefficients.tolist())), self.beyond)

    def __call__(self, t: ArrayLike) -> Array:
        """Return z at t [s], evaluated by `precise` and rounded to float64; at a breakpoint, by the piece after it."""
        return self.precise([np.asarray(t, dtype=float)]).high

    def summed(self, t: ArrayLike) -> Array:
        """Return z at t [s]; sums of kernels have a method of the same name, so that callers can use either."""
        return self(t)

    def precise(self, time: Sequence[Array]) -> DoubleDouble:
        """Return z by Horner's rule in twice the precision, at times that are sums of a few float64 [s].

        The piece that contains the time is found without any rounding. With n = `degree` and u = 2⁻⁵³, the error is
        less than 100 (n + 1) u² Σ_j |c_ij| (t_(i+1) − t_i)^j, for times of less than 2⁵⁰ periods.
        """
        ends = self.breakpoints
        if len(time) == 1 and self.beyond != "period":  # float64 numbers are compared without rounding, and faster
            t = np.clip(time[0], ends[0], ends[-1]) if self.beyond == "rest" else time[0]
            piece = piece_at(ends, t)
            since = DoubleDouble(*two_sum(t, -ends[piece]))
        else:
            piece, local = self._place(ExactSum.of(np.broadcast_arrays(*time)))
            since = local.double_double
        zero = np.zeros(piece.shape)
        value = DoubleDouble(self.coefficients[piece, -1], zero)
        for j in range(self.degree - 1, -1, -1):
            value = value * since + DoubleDouble(self.coefficients[piece, j], zero)
        return value

    def _place(self, t: ExactSum) -> tuple[npt.NDArray[np.intp], ExactSum]:
        """Return the index i of the piece at t, and t − t_i [s].

        If z rests before t_0 and after t_n, earlier times count as t_0 and later ones as t_n.
        """
        ends = self.breakpoints
        if self.beyond == "rest":
            t = t.replace((t + -ends[0]).rounded < 0, ends[0])
            t = t.replace((t + -ends[-1]).rounded > 0, ends[-1])
        elif self.beyond == "period":
            t = self._in_first_period(t)
        last = len(self.coefficients) - 1
        piece = piece_at(ends, t.rounded)
        while True:  # rounding may have led to a neighbouring piece: move until t lies in the piece
            early, late = (t + -ends[piece]).rounded < 0, (t + -ends[piece + 1]).rounded >= 0
            moved = np.clip(piece - early + late, 0, last)
            if np.array_equal(moved, piece):
                return piece, t + -ends[piece]
            piece = moved

    def _in_first_period(self, t: ExactSum) -> ExactSum:
        """Return times moved by whole periods into the half-open interval from the first to the last breakpoint."""
        first, period = self.breakpoints[0], np.asarray(self.period)
        turns = np.floor((t + -first).rounded / period)
        since = (t + -first).turned_back(turns, period)
        turns = turns - (since.rounded < 0) + ((since + -period).rounded >= 0)
        return t.turned_back(turns, period)


def increasing(what: str, given: ArrayLike) -> Array:
    """Return increasing times [s], read-only. ValueError: there are less than two, or they do not increase."""
    times = array(what, given, None)
    if len(times) < 2 or not np.all(np.diff(times) > 0):
        raise ValueError(
            f"{what} must be two finite numbers at least, each larger than the one before, got {short(times.tolist())}"
        )
    return times


def piece_at(ends: Array, times: Array) -> npt.NDArray[np.intp]:
    """Return the index of the piece between two `ends` in which each time lies; the nearest one for times outside."""
    return np.clip(np.searchsorted(ends, times, side="right") - 1, 0, len(ends) - 2)


def is_spline(given: object) -> TypeGuard[PPoly | BPoly | BSpline]:
    """Return whether `given` is a spline of SciPy. It cannot be one if scipy.interpolate is not loaded."""
    made = sys.modules.get("scipy.interpolate")
    return made is not None and isinstance(given, made.PPoly | made.BPoly | made.BSpline)


def pieces_of_spline(given: PPoly | BPoly | BSpline) -> tuple[Array, Array]:
    """Return breakpoints t_i [s], shape (K + 1,), and coefficients of (t − t_i)^j, of the K pieces of a SciPy spline.

    The coefficients have the shape (degree + 1, K, …). Pieces without length are left out. Of a B-spline of degree k,
    the first k and the last k knots are left out, because an interval beyond the other knots has fewer than k + 1 basis
    functions. ValueError: breakpoints decrease, are no numbers, or are all the same.
    """
    if isinstance(given, scipy.interpolate.BSpline):
        inside = given.t[given.k : len(given.t) - given.k]
        ends = inside[np.append(True, np.diff(inside) > 0)]  # without repeated knots
        return ends, np.stack([given(ends[:-1], nu=k) / factorial(k) for k in range(given.k + 1)])
    if isinstance(given, scipy.interpolate.BPoly):
        given = scipy.interpolate.PPoly.from_bernstein_basis(given)
    if not (np.all(np.diff(given.x) >= 0) and given.x[0] < given.x[-1]):
        raise ValueError(f"spline: breakpoints must be numbers that increase, got {short(given.x.tolist())}")
    kept = np.flatnonzero(np.diff(given.x) > 0)
    return np.append(given.x[kept], given.x[kept[-1] + 1]), given.c[::-1, kept]


def _table(values: Mapping[float, float], period: float | None) -> tuple[list[float], list[float], Beyond]:
    """Return the times of some values, the values, and whether they repeat.

    TypeError: these are no numbers. ValueError: no values, times that do not increase, or a period that is ≤ 0.
    """
    instance("pieces: values", values, Mapping, "values by their times [s], as {0.0: 0.05, 2.5: 0.08}")
    found = {real("pieces: time", t): real(f"pieces: value at {t} s", value) for t, value in values.items()}
    if not found or any(a >= b for a, b in pairwise(found)):
        raise ValueError(f"pieces: expected values at increasing times [s], got the times {list(found)}")
    repeats = period is not None and positive("pieces: period", period)
    return [*found], [*found.values()], "period" if repeats else "rest"


# Signals, of which a reference is made: they can be evaluated, and a proof can enclose them.

Signal = KernelSum | PolynomialPieces
"""A sum of kernels, which is learned from samples, or polynomial pieces, which come from splines and planners."""
