"""A piecewise polynomial signal, as plain stored numbers: any spline is one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
import numpy.typing as npt

from trackably.arguments import numbers
from trackably.arrays import Array, ArrayLike
from trackably.systems.signals.double_double import DoubleDouble
from trackably.systems.signals.exact_sum import ExactSum

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
        ends, c = numbers("pieces: breakpoints", self.breakpoints), numbers("pieces: coefficients", self.coefficients)
        if ends.ndim != 1 or len(ends) < 2 or not np.all(np.isfinite(ends)) or not np.all(np.diff(ends) > 0):
            raise ValueError("pieces: breakpoints must be two finite numbers at least, each larger than the one before")
        if c.ndim != 2 or len(c) != len(ends) - 1 or not c.size or not np.all(np.isfinite(c)):
            raise ValueError(
                f"pieces: coefficients must be finite, a row for each of {len(ends) - 1} pieces, got shape {c.shape}"
            )
        if self.beyond not in get_args(Beyond):
            raise ValueError(f"pieces: beyond must be one of {', '.join(get_args(Beyond))}, got {self.beyond!r}")
        for name, array in (("breakpoints", ends), ("coefficients", c)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)
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
