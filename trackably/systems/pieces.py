"""Signals of a reference: sums of kernels or piecewise polynomials, which are evaluated in twice the precision."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Literal, Self, get_args

import numpy as np
import numpy.typing as npt

from trackably.arguments import array, numbers
from trackably.arrays import Array, ArrayLike
from trackably.gp.signal import KernelSum

# Numbers of twice the precision: unevaluated sums of two float64, elementwise in arrays.
#
# Sums and products are those of Dekker, "A floating-point technique for extending the available precision" (1971).
# Their errors are bounded by Joldes, Muller and Popescu, "Tight and rigorous error bounds for basic building blocks of
# double-word arithmetic" (2017): with u = 2⁻⁵³, they are less than 8 u² of |x y| in a product, and of |x| + |y| in a
# sum. Numbers must neither overflow nor underflow. NumPy rounds each operation by itself, without fused
# multiplications.

_SPLITTER = 2.0**27 + 1


@dataclass(frozen=True, eq=False)
class DoubleDouble:
    """`high` + `low`, where `high` is the float64 that is nearest to the sum."""

    high: Array
    low: Array

    @classmethod
    def of(cls, numbers: Sequence[Fraction]) -> Self:
        """Return rational numbers, each within u² of its size."""
        high = [float(number) for number in numbers]
        low = [float(number - Fraction(near)) for number, near in zip(numbers, high, strict=True)]
        return cls(np.array(high), np.array(low))

    def at(self, index: Any) -> DoubleDouble:
        """Return the numbers at an index of the arrays."""
        return DoubleDouble(self.high[index], self.low[index])

    def __add__(self, other: DoubleDouble) -> DoubleDouble:
        high, error = two_sum(self.high, other.high)
        low, smaller = two_sum(self.low, other.low)
        high, error = _two_sum_ordered(high, error + low)
        return DoubleDouble(*_two_sum_ordered(high, error + smaller))

    def __mul__(self, other: DoubleDouble) -> DoubleDouble:
        product, error = two_product(self.high, other.high)
        return DoubleDouble(*_two_sum_ordered(product, error + (self.high * other.low + self.low * other.high)))


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Return s = fl(a + b) and a + b − s, which is a float64."""
    total = a + b
    of_b = total - a
    return total, (a - (total - of_b)) + (b - of_b)


def _two_sum_ordered(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the same where |a| ≥ |b|, or a = 0."""
    total = a + b
    return total, b - (total - a)


def two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """Return p = fl(a b) and a b − p, which is a float64."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def moved_back(time: Sequence[Array], period: float) -> Array:
    """Return times [s], each the sum of one float64 or of two as `two_product` gives them, moved by whole periods.

    With u = 2⁻⁵³ and p = fl(n `period`), where n is the nearest whole number of periods: `high` − p is exact by
    Sterbenz's lemma, as p is at least half of `high` and at most twice, or 0. What remains of both is less than u of
    their size. So up to 2⁴⁰ periods the result is at most 0.501 periods from 0, and within 0.502 u periods of exact.
    Times within half a period stay as they are, rounded.
    """
    high, *low = time
    whole, rest = two_product(np.rint(high / period), np.asarray(period))
    return np.asarray((high - whole) + (sum(low) - rest))


def _halves(a: Array) -> tuple[Array, Array]:
    """Split a float64 into its high and its low half: two numbers of 26 bits at most with the sum a."""
    scaled = _SPLITTER * a
    high = scaled - (scaled - a)
    return high, a - high


# Sums of a few float64 without any rounding, elementwise in arrays: times are compared and subtracted by them.


@dataclass(frozen=True, eq=False)
class ExactSum:
    """The exact sum of `parts`, ordered by size: an expansion, as Shewchuk (1997) calls it.

    Between the binary digits of two parts there is an empty place at least, as long as each term is added to a sum that
    began with one float64. So all smaller parts together are less than half of the largest one.
    """

    parts: tuple[Array, ...]

    @classmethod
    def of(cls, terms: Iterable[Array]) -> Self:
        """Return the sum of float64 numbers."""
        first, *others = terms
        found = cls((first,))
        for term in others:
            found = found + term
        return found

    def __add__(self, term: Array) -> Self:
        found, total = [], term
        for part in self.parts:
            total, error = two_sum(total, part)
            found.append(error)
        return type(self)((*found, total))

    @property
    def rounded(self) -> Array:
        """The sum in float64, within 8 u of its size as long as there are eight parts at most: its sign is right."""
        total = self.parts[0]
        for part in self.parts[1:]:
            total = total + part
        return total

    @property
    def double_double(self) -> DoubleDouble:
        """The sum, within 80 u² of its size as long as there are seven parts at most."""
        near = self.rounded
        return DoubleDouble(*two_sum(near, (self + -near).rounded))

    def turned_back(self, count: Array, period: Array) -> Self:
        """Return the sum minus `count` times a period."""
        whole, rest = two_product(count, period)
        return self + -whole + -rest

    def replaced(self, where: npt.NDArray[np.bool_], value: float) -> Self:
        """Return a number in place of the sum at some places."""
        *others, last = (np.where(where, 0.0, part) for part in self.parts)
        return type(self)((*others, np.where(where, value, last)))


# A piecewise polynomial signal, as plain stored numbers: any spline is one.

Beyond = Literal["rest", "period", "end"]
"""What a signal is beyond its pieces: at rest at its first and its last value, repeated, or nothing to claim."""


@dataclass(frozen=True, eq=False)
class PolynomialPieces:
    """z(t) = Σ_j c_ij (t − t_i)^j for t_i ≤ t < t_(i+1), with `breakpoints` t_i [s] and `coefficients` c_ij.

    Shapes (n + 1,) and (n, degree + 1). The stored float64 numbers are exact; pieces need not meet. `beyond` says what
    z is for other times: "rest", z(t_0) before and the limit of z at t_n after; "period", repeated every t_n − t_0; or
    "end", where claims are about times between t_0 and t_n only (the first and the last piece are continued by
    evaluation, so that rounding of t at an end does no harm).

    ValueError: breakpoints do not increase, shapes do not fit, a number is not finite, or the period is no float64.
    """

    breakpoints: Array
    coefficients: Array
    beyond: Beyond = "rest"

    if TYPE_CHECKING:  # arrays are made of what is given

        def __init__(self, breakpoints: ArrayLike, coefficients: ArrayLike, beyond: Beyond = "rest") -> None: ...

    def __post_init__(self) -> None:
        ends = numbers("pieces: breakpoints", self.breakpoints)
        if ends.ndim != 1 or len(ends) < 2 or not np.all(np.isfinite(ends)) or not np.all(np.diff(ends) > 0):
            raise ValueError("pieces: breakpoints must be two finite numbers at least, each larger than the one before")
        c, ends.flags.writeable = array("pieces: coefficients", self.coefficients, len(ends) - 1, None), False
        if self.beyond not in get_args(Beyond):
            raise ValueError(f"pieces: beyond must be one of {', '.join(get_args(Beyond))}, got {self.beyond!r}")
        object.__setattr__(self, "breakpoints", ends)
        object.__setattr__(self, "coefficients", c)
        if self.beyond == "period" and Fraction(self.period) != Fraction(ends[-1]) - Fraction(ends[0]):
            raise ValueError(
                f"pieces: the period, from {ends[0]!r} s to {ends[-1]!r} s, must be exact in float64; let the first "
                "breakpoint be 0"
            )

    @property
    def degree(self) -> int:
        """The degree of the pieces; higher coefficients may be zero."""
        return int(self.coefficients.shape[1]) - 1

    @property
    def period(self) -> float:
        """How long all pieces take together [s]."""
        return float(self.breakpoints[-1] - self.breakpoints[0])

    def jet(self, t: ArrayLike, order: int) -> Array:
        """Return z and its time derivatives up to `order` at t [s]: shape (order + 1, *t.shape).

        At a breakpoint they are those of the piece that begins there.
        """
        t = np.asarray(t, dtype=float)
        inside, piece, local = self._place(t)
        found = [_horner(self.coefficients, piece, local)]
        for derived in self._derivatives(order):
            found.append(np.where(inside, _horner(derived, piece, local), 0.0))
        return np.stack(found)

    def __call__(self, t: ArrayLike) -> Array:
        return np.asarray(self.jet(t, 0)[0])

    def summed(self, t: ArrayLike) -> Array:
        """Return z at t [s], rounded once: `precise` in float64."""
        return self.precise([np.asarray(t, dtype=float)]).high

    def precise(self, time: Sequence[Array]) -> DoubleDouble:
        """Return z by Horner's rule in twice the precision, at times that are sums of a few float64 [s].

        The piece that holds there is found without any rounding. With n = `degree` and u = 2⁻⁵³, the error is less than
        100 (n + 1) u² Σ_j |c_ij| (t_(i+1) − t_i)^j, for times of less than 2⁵⁰ periods.
        """
        piece, local = self._place_exactly(ExactSum.of(np.broadcast_arrays(*time)))
        since, zero = local.double_double, np.zeros(piece.shape)
        value = DoubleDouble(self.coefficients[piece, -1], zero)
        for j in range(self.degree - 1, -1, -1):
            value = value * since + DoubleDouble(self.coefficients[piece, j], zero)
        return value

    def _place_exactly(self, t: ExactSum) -> tuple[npt.NDArray[np.intp], ExactSum]:
        """Return which piece holds at t, and t − t_i [s]. At rest, the time is that at which it begins."""
        ends = self.breakpoints
        if self.beyond == "rest":
            t = t.replaced((t + -ends[0]).rounded < 0, ends[0])
            t = t.replaced((t + -ends[-1]).rounded > 0, ends[-1])
        elif self.beyond == "period":
            t = self._in_first_period(t)
        last = len(self.coefficients) - 1
        piece = np.clip(np.searchsorted(ends, t.rounded, side="right") - 1, 0, last)
        while True:  # rounded times are next to a breakpoint at most
            early, late = (t + -ends[piece]).rounded < 0, (t + -ends[piece + 1]).rounded >= 0
            moved = np.clip(piece - early + late, 0, last)
            if np.array_equal(moved, piece):
                return piece, t + -ends[piece]
            piece = moved

    def _in_first_period(self, t: ExactSum) -> ExactSum:
        """Return times from the first breakpoint to before the last one, moved by whole periods."""
        first, period = self.breakpoints[0], np.asarray(self.period)
        turns = np.floor((t + -first).rounded / period)
        since = (t + -first).turned_back(turns, period)
        turns = turns - (since.rounded < 0) + ((since + -period).rounded >= 0)
        return t.turned_back(turns, period)

    def derivative(self, t: ArrayLike) -> Array:
        return np.asarray(self.jet(t, 1)[1])

    def _place(self, t: Array) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.intp], Array]:
        """Return whether z may move at t, which piece holds there, and t − t_i [s]."""
        first, last = self.breakpoints[0], self.breakpoints[-1]
        inside = np.full(t.shape, True)
        if self.beyond == "rest":
            inside = (t >= first) & (t < last)
            t = np.clip(t, first, last)
        elif self.beyond == "period":
            t = first + np.mod(t - first, self.period)
        piece = np.clip(np.searchsorted(self.breakpoints, t, side="right") - 1, 0, len(self.coefficients) - 1)
        return inside, piece, t - self.breakpoints[piece]

    def _derivatives(self, order: int) -> Sequence[Array]:
        found, c = [], self.coefficients
        for _ in range(order):
            c = c[:, 1:] * np.arange(1, c.shape[1]) if c.shape[1] > 1 else np.zeros_like(c)
            found.append(c)
        return found


def _horner(coefficients: Array, piece: npt.NDArray[np.intp], local: Array) -> Array:
    """Evaluate the pieces of these numbers: the shape of `local`."""
    value = coefficients[piece, -1]
    for j in range(coefficients.shape[1] - 2, -1, -1):
        value = value * local + coefficients[piece, j]
    return np.asarray(value)


# What a reference is made of: signals that can be evaluated here, and enclosed by a proof.

Signal = KernelSum | PolynomialPieces
"""A sum of kernels, as samples are learned, or polynomial pieces, as splines and planners give them."""
