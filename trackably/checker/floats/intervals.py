"""Arrays of float64 intervals: every result contains the real numbers that it stands for, despite all rounding.

Assumed: IEEE arithmetic rounding to nearest, with subnormal numbers, sums in any order, also in products of matrices,
and NumPy's exp, log, sqrt, cos, arctan and arctan2 within 4 units in the last place. Each end of a result is computed
in float64 and moved outwards by more than its error: the error of one operation is at most 2⁻⁵³ of the computed number,
or 2⁻¹⁰⁷⁵; that of a function at most 2⁻⁵⁰ of the computed number, or 2⁻¹⁰⁷². An end that is NaN bounds nothing, and
every comparison with it is False; all operations, also minima and maxima, give NaN again.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache, reduce
from operator import add, mul
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from trackably.checker.intervals import ONE, ZERO, Many, Real, exactly, pi
from trackably.checker.polynomials import bernstein_form, compose

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

_MOST_SUMMED = 16
_OPERATION, _FUNCTION, _TINY = 2.0**-51, 2.0**-48, 2.0**-1000
"""By how much ends are moved outwards: relative to results of + − · /, relative to values of functions, and absolutely.

`_TINY` is far more than what products and functions lose by underflow; sums lose nothing. It is also the least radius
in products, where an error that underflows could be multiplied by a large factor.
"""


def _increasing(of: Callable[[Array], Array]) -> Callable[["Floats"], "Floats"]:
    """Return an increasing function of intervals, from NumPy's; NaN if a number may be outside of its domain."""
    return lambda x: _outwards(of(x.low), of(x.high), _FUNCTION)


@dataclass(frozen=True, eq=False)
class Floats(Many):
    """Arrays of intervals with the ends `low` and `high`, which broadcast as NumPy's arrays do.

    Operands may also be numbers and intervals of mpmath.
    """

    low: Array
    high: Array

    @classmethod
    def exact(cls, values: npt.ArrayLike) -> Self:
        """Return intervals that contain one number each."""
        numbers = np.asarray(values, dtype=np.float64)
        return cls(numbers, numbers)

    @classmethod
    def of(cls, number: Any) -> "Floats":
        """Return arrays of intervals unchanged; for a number or an interval of mpmath, an interval that contains it."""
        return number if isinstance(number, Floats) else _of_interval(number)

    @property
    def a(self) -> "Floats":
        return Floats(self.low, self.low)

    @property
    def b(self) -> "Floats":
        return Floats(self.high, self.high)

    @property
    def mid(self) -> "Floats":
        return Floats.exact(self._around[0])

    def at(self, index: Any) -> "Floats":
        """Return the intervals at an index, of any kind that NumPy's arrays take."""
        return Floats(self.low[index], self.high[index])

    @cached_property
    def _around(self) -> tuple[Array, Array, Array, Array, Array]:
        """What `dot` needs of each interval: a number m near its middle, |m|, r, b, and an upper bound of r + 2⁻⁴⁸ b.

        Here r is an upper bound of |x − m|, and b one of |x|, for all x in the interval.
        """
        middle = self.low / 2 + self.high / 2
        radius = np.maximum(self.high - middle, middle - self.low) * (1 + _OPERATION) + _TINY
        largest = ((size := np.abs(middle)) + radius) * (1 + _OPERATION)
        return middle, size, radius, largest, (radius + 2.0**-48 * largest) * (1 + _OPERATION)

    @classmethod
    def dot(cls, xs: Any, ys: Any) -> Any:
        """Return Σ x_j y_j, by fewer operations than separate products.

        If |x_j − m_j| ≤ r_j and |y_j − n_j| ≤ s_j, the sum is within Σ (|m_j| s_j + r_j (|n_j| + s_j)) of Σ m_j n_j.
        For at most 16 terms, rounding of this sum and of each end adds less than 2⁻⁴⁸ Σ |m_j| |n_j|. The computed
        bounds have a relative error of at most 2⁻⁴⁶, and underflow adds less than `_TINY`.
        """
        pairs = [(cls.of(x), cls.of(y)) for x, y in zip(xs, ys, strict=True) if x is not ZERO and y is not ZERO]
        found: Any = ZERO
        for begin in range(0, len(pairs), _MOST_SUMMED):
            some = [(x._around, y._around) for x, y in pairs[begin : begin + _MOST_SUMMED]]
            value = reduce(add, [m * n for (m, *_), (n, *_) in some])
            off = reduce(add, [size * apart + r * most for (_, size, r, *_), (*_, most, apart) in some])
            found = _within(value, off) + found
        return found

    @classmethod
    def larger(cls, one: Any, other: Any) -> "Floats":
        x, y = cls.of(one), cls.of(other)
        return Floats(np.maximum(x.low, y.low), np.maximum(x.high, y.high))

    @classmethod
    def choose(cls, condition: Any, one: Any, other: Any) -> "Floats":
        x, y = cls.of(one), cls.of(other)
        return Floats(np.where(condition, x.low, y.low), np.where(condition, x.high, y.high))

    def __add__(self, other: Any) -> "Floats":
        if other is ZERO:
            return self
        y = self.of(other)
        return _outwards(self.low + y.low, self.high + y.high, tiny=0.0)  # sums do not underflow

    def __neg__(self) -> "Floats":
        return Floats(-self.high, -self.low)

    def __sub__(self, other: Any) -> "Floats":
        y = self.of(other)
        return _outwards(self.low - y.high, self.high - y.low, tiny=0.0)

    def __rsub__(self, other: Any) -> "Floats":
        return self.of(other) - self

    @property
    def _ends(self) -> tuple[Array, ...]:
        """Both ends, or one if these are exact numbers, not intervals."""
        return (self.low,) if self.low is self.high else (self.low, self.high)

    def __mul__(self, other: Any) -> "Floats":
        return self if other is ONE else _hull(*[x * y for x in self._ends for y in self.of(other)._ends])

    def __truediv__(self, other: Any) -> "Floats":
        y = self.of(other)
        ends = [np.where((y.low > 0) | (y.high < 0), end, np.nan) for end in y._ends]
        return _hull(*[x / end for x in self._ends for end in ends])

    def __rtruediv__(self, other: Any) -> "Floats":
        return self.of(other) / self

    __radd__ = __add__
    __rmul__ = __mul__

    def __pow__(self, exponent: int) -> "Floats":
        """Return x^exponent for a whole exponent ≥ 1; even powers are computed from |x|, which is narrower."""
        return reduce(mul, [self if exponent % 2 else abs(self)] * exponent)

    def __abs__(self) -> "Floats":
        nearest = np.maximum(np.maximum(self.low, -self.high), 0.0)
        return Floats(nearest, np.maximum(-self.low, self.high))

    def __lt__(self, other: Any) -> Any:
        return self.high < self.of(other).low

    def __le__(self, other: Any) -> Any:
        return self.high <= self.of(other).low

    def __gt__(self, other: Any) -> Any:
        return self.low > self.of(other).high

    def __ge__(self, other: Any) -> Any:
        return self.low >= self.of(other).high

    def exp(self) -> "Floats":
        found = _increasing(np.exp)(self)
        return Floats(np.maximum(found.low, 0.0), found.high)

    def cos(self) -> "Floats":
        """Return the cosine. It decreases on [0, π], which contains the distance to the nearest multiple of 2π."""
        turn, middle = 2 * np.pi, (self.low + self.high) / 2
        angle = np.abs(middle - turn * np.rint(middle / turn))
        # float64's 2π is off by at most 2.45e-16 in each turn, and every operation above by at most 2⁻⁵² |middle|.
        off = ((self.high - self.low) / 2 + 2.0**-49 * (np.abs(middle) + 1)) * (1 + _OPERATION)
        low, high = np.cos(np.minimum(angle + off, np.pi)), np.cos(np.maximum(angle - off, 0.0))
        return _outwards(low, high, 2.0**-46, 2.0**-50)

    log, sqrt, atan = _increasing(np.log), _increasing(np.sqrt), _increasing(np.arctan)

    @classmethod
    def direction(cls, y: Any, x: Any) -> "Floats":
        angle = np.arctan2(cls.of(y).low, cls.of(x).low)
        return _outwards(angle, angle, _FUNCTION)

    def sin(self) -> "Floats":
        return (self - pi() / 2).cos()


def _outwards(low: Array, high: Array, part: float = _OPERATION, tiny: float = _TINY) -> Floats:
    """Move the ends of intervals outwards, by a `part` of their absolute values, and by `tiny` against underflow."""
    down, up = np.abs(low) * part, np.abs(high) * part
    return Floats(low - (down + tiny), high + (up + tiny)) if tiny else Floats(low - down, high + up)


def _within(value: Array, off: Array) -> Floats:
    """Return the interval from value − off to value + off, enlarged by the rounding errors that `Floats.dot` states.

    Both ends are NaN if `value` has overflowed.
    """
    off = off * (1 + 2.0**-45) + (_TINY + 0 * value)
    return Floats(value - off, value + off)


def _hull(*ends: Array) -> Floats:
    return _outwards(reduce(np.minimum, ends), reduce(np.maximum, ends))


@lru_cache(maxsize=4096)
def _of_interval(number: Any) -> Floats:
    """Return the smallest interval with float64 ends that contains a number or an interval of mpmath.

    Results are cached, because the same few intervals occur again and again.
    """
    number = exactly(number)
    low, high = _float(number.a, -np.inf), _float(number.b, np.inf)
    return Floats.exact(low) if low == high else Floats(np.asarray(low), np.asarray(high))


def _float(number: Real, towards: float) -> float:
    """Return a number of mpmath as a float64, rounded `towards` −∞ or ∞."""
    nearest = float(number)
    return nearest if exactly(nearest) == number else float(np.nextafter(nearest, towards))


def stack(rows: Sequence[Any], shape: tuple[int, ...]) -> Floats:
    """Return numbers and arrays of intervals along a new first axis, each as an array of the same `shape`."""
    low, high = np.empty((2, len(rows), *shape))
    for i, row in enumerate(map(Floats.of, rows)):
        low[i], high[i] = row.low, row.high
    return Floats(low, high)


def sums(of: Floats, firsts: npt.NDArray[np.intp]) -> Floats:
    """Return sums of consecutive numbers on the last axis: sum k begins at firsts[k], and ends before the next one."""
    counts = np.diff(firsts, append=of.low.shape[-1])
    size = np.add.reduceat(np.maximum(np.abs(of.low), np.abs(of.high)), firsts, axis=-1)
    off = size * ((counts + 8) * _OPERATION)
    low, high = (np.add.reduceat(end, firsts, axis=-1) for end in (of.low, of.high))
    return Floats(low - off, high + off) + Floats.exact(0.0)


def bernstein_of(polynomials: Floats) -> Floats:
    """Return Bernstein coefficients on [−1, 1], (n, B), of B polynomials Σ_k a_k x^k, (n, B).

    They are the product of the matrix `nearest`, whose entries b_k were rounded to float64, and of columns of a_k. With
    |a_k − m_k| ≤ r_k and |a_k| ≤ c_k, the sum Σ b_k a_k is within Σ |b_k| r_k of Σ b_k m_k. Rounding of the b_k, of
    this sum in any order, and of each end adds less than (n + 8) 2⁻⁵² Σ |b_k| c_k.
    """
    nearest, (middle, _, radius, largest, _) = bernstein(len(polynomials.low), -1, 2), polynomials._around
    off = np.abs(nearest) @ (radius + (len(middle) + 8) * 2.0**-52 * largest)
    # An implementation may leave out products with zeros, but an entry that bounds nothing makes its column NaN.
    return _within(nearest @ middle + 0 * np.sum(largest, axis=0), off)


@cache
def bernstein(n: int, start: int = 0, width: int = 1) -> Array:
    """Return Bernstein coefficient i of x^k on [start, start + width], in degree n − 1 and rounded once, at [i, k].

    With x = start + width y, x^k is a polynomial in y on [0, 1].
    """
    powers = (bernstein_form(compose([int(j == k) for j in range(n)], start, width)) for k in range(n))
    return np.column_stack([[c / unit for c in found] for found, unit in powers])  # quotients of integers round once
