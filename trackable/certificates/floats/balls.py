"""Arrays of balls in float64, with outward rounding: what kernels and their bounds need, under the names of arb.

Assumed, as for the evaluation of references: IEEE arithmetic rounding to nearest (u = 2⁻⁵³), sums in any order, and
NumPy's functions within 4 units in the last place. A ball that is not finite encloses everything. So does one that
holds a NaN: every comparison with it is False.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from flint import arb

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic, float_above

U = 2.0**-53
FUNCTION = 9 * U
"""4 units in the last place are at most 8 u of the value, and a little more of the computed one."""

UP = 1 + 2.0**-49
"""Radii are sums and products of few positive numbers: this covers their own rounding."""

TINY, _NORMAL = 2.0**-1000, 2.0**-1020
"""More than any underflow, and than any number below which precision is lost."""

_ZERO = np.zeros(())
_ZERO.flags.writeable = False

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Balls:
    """Real numbers within `rad` of `mid`; arrays that broadcast, and other operands: exact numbers and arb."""

    mid: Array
    rad: Array

    @classmethod
    def exact(cls, values: Array | float) -> Self:
        """Return balls of radius zero."""
        return cls(np.asarray(values, dtype=float), _ZERO)

    @classmethod
    def of(cls, number: Any) -> Self:
        """Return a ball that contains an arb, or a whole number or float64."""
        if isinstance(number, cls):
            return number
        if not isinstance(number, arb):
            return cls.exact(number)
        with ball_arithmetic():
            mid = float(number.mid())
            off = abs(number - arb(mid)) if math.isfinite(mid) else arb.pos_inf()
            return cls(np.asarray(mid), np.asarray(0.0 if off.is_zero() else float_above(off)))

    @classmethod
    def chosen(cls, condition: Mask, one: Any, other: Any) -> Self:
        """Return one where the condition holds and the other elsewhere."""
        a, b = cls.of(one), cls.of(other)
        return cls(np.where(condition, a.mid, b.mid), np.where(condition, a.rad, b.rad))

    def is_zero(self) -> Mask:
        """Whether a ball is the number zero."""
        return np.asarray((self.mid == 0) & (self.rad == 0))

    @property
    def size(self) -> Array:
        """Over-estimate of every |x| in the balls."""
        return np.asarray((np.abs(self.mid) + self.rad) * UP)

    @property
    def highest(self) -> Array:
        """Over-estimate of every x in the balls."""
        return np.nextafter(self.mid + self.rad, np.inf)

    @property
    def lowest(self) -> Array:
        """Under-estimate of every x in the balls."""
        return np.nextafter(self.mid - self.rad, -np.inf)

    def upper(self) -> Self:
        """Return the highest ends, as numbers."""
        return self.exact(self.highest)

    def at(self, index: Any) -> Self:
        """Return the balls at an index of arrays."""
        return type(self)(self.mid[index], self.rads[index])

    @property
    def rads(self) -> Array:
        """The radii in the shape of the middles."""
        return self.rad if self.rad.shape == self.mid.shape else np.broadcast_to(self.rad, self.mid.shape)

    def __add__(self, other: Any) -> Self:
        b = self.of(other)
        mid = self.mid + b.mid
        return type(self)(mid, (self.rad + b.rad + U * np.abs(mid)) * UP)

    def __neg__(self) -> Self:
        return type(self)(-self.mid, self.rad)

    def __sub__(self, other: Any) -> Self:
        return self + -self.of(other)

    def __rsub__(self, other: Any) -> Self:
        found: Self = -self + other
        return found

    def __mul__(self, other: Any) -> Self:
        if isinstance(other, float):
            mid = self.mid * other
            return type(self)(mid, (self.rad * abs(other) + U * np.abs(mid)) * UP + TINY)
        b = self.of(other)
        mid = self.mid * b.mid
        size = np.abs(b.mid)
        rad = (np.abs(self.mid) * b.rad + self.rad * (size + b.rad) + U * np.abs(mid)) * UP + TINY
        return type(self)(mid, rad)

    def inverse(self) -> Self:
        """Return 1/x; everything where a ball contains zero."""
        least = (np.abs(self.mid) - self.rad) / UP
        mid = 1 / self.mid
        off = self.rad / np.abs(self.mid) / least + U * np.abs(mid)  # their product could overflow
        return type(self)(mid, np.where(least > 0, off * UP, np.inf) + TINY)

    def __truediv__(self, other: Any) -> Self:
        if isinstance(other, Balls):
            return self * self.of(other).inverse()
        with ball_arithmetic():
            return self * (1 / arb(other))

    __radd__ = __add__
    __rmul__ = __mul__

    def __pow__(self, exponent: int) -> Self:
        assert exponent == 2, "only squares are needed"
        return self * self

    def __abs__(self) -> Self:
        return type(self)(np.abs(self.mid), self.rad)

    def __gt__(self, other: Any) -> Mask:
        return np.asarray(self.lowest > self.of(other).highest)

    def __ge__(self, other: Any) -> Mask:
        return np.asarray(self.lowest >= self.of(other).highest)

    def __le__(self, other: Any) -> Mask:
        return np.asarray(self.highest <= self.of(other).lowest)

    def max(self, other: Any) -> Self:
        """Return the larger one: max is 1-Lipschitz in both."""
        b = self.of(other)
        return type(self)(np.maximum(self.mid, b.mid), np.maximum(self.rad, b.rad))

    def min(self, other: Any) -> Self:
        """Return the smaller one."""
        b = self.of(other)
        return type(self)(np.minimum(self.mid, b.mid), np.maximum(self.rad, b.rad))

    def exp(self) -> Self:
        """Return e^x: e^(x + d) is within e^x (e^|d| − 1) of e^x, and at most e^(x + |d|) away."""
        mid = np.exp(self.mid)
        size = np.maximum(mid, _NORMAL)  # e^x where it is rounded to zero, or nearly
        near = size * (np.expm1(self.rad) * (1 + 4 * FUNCTION) + FUNCTION)
        # Far below zero the first bound may overflow.
        return type(self)(mid, np.fmin(near, np.exp(self.highest) * (1 + 2 * FUNCTION)) * UP + TINY)

    def log(self) -> Self:
        """Return ln x; everything where a ball does not lie above zero."""
        least = (self.mid - self.rad) / UP
        with np.errstate(invalid="ignore", divide="ignore"):
            mid = np.log(self.mid)
            rad = np.where(least > 0, (self.rad / least + FUNCTION * np.abs(mid)) * UP + TINY, np.inf)
        return type(self)(np.where(least > 0, mid, 0.0), rad)

    def cosh(self) -> Self:
        """Return cosh x."""
        e = self.exp()
        return (e + (-self).exp()) * 0.5

    def cos(self) -> Self:
        """Return cos x: the range of each ball, which is narrow for wide balls around an extreme too."""
        turn = 2 * np.pi
        # The angle from 0 to π to the next multiple of 2π; the rounded 2π is off by 2⁻⁵² at most, in every turn.
        angle = np.abs(self.mid - turn * np.rint(self.mid / turn))
        off = (self.rad + 2.0**-50 * (np.abs(self.mid) + 1)) * UP
        high = np.cos(np.maximum(angle - off, 0.0))
        low = np.cos(np.minimum(angle + off, np.pi))
        return type(self)((high + low) / 2, ((high - low) / 2 + FUNCTION + 4 * U) * UP)


def joined(parts: Iterable[Balls]) -> Balls:
    """Join arrays of balls along their last axis."""
    found = list(parts)
    if len(found) == 1:
        return found[0]
    mids, rads = zip(*((each.mid, each.rads) for each in found), strict=True)
    return Balls(np.concatenate(mids, axis=-1), np.concatenate(rads, axis=-1))


def sums_up(values: Array, terms: int) -> Array:
    """Enlarge sums of so many positive `terms`, in any order, to what they are at most in exact arithmetic."""
    return np.asarray(values * (1 + (terms + 8) * 2 * U) + TINY * terms)
