"""Power series with arrays of float64 balls as coefficients: what the kernels need, under the names of arb_series."""

from dataclasses import dataclass
from functools import cache
from typing import Any, Self

import numpy as np
from flint import arb

from trackable.arrays import Array
from trackable.certificates.floats.balls import Balls, Mask, U, sums_up


@dataclass(frozen=True, eq=False)
class Series:
    """Σ_k a_k x^k up to x^(terms − 1), for many series at once.

    `mid` and `rad` have shape (d, P): further coefficients of each of the P series are zero.
    """

    mid: Array
    rad: Array
    terms: int

    @classmethod
    def of(cls, coefficients: list[Balls], terms: int) -> Self:
        """Return the series with these coefficients, as many as fit."""
        kept = coefficients[:terms]
        mid = np.stack(np.broadcast_arrays(*(c.mid for c in kept)))
        return cls(mid, np.stack([np.broadcast_to(c.rad, mid.shape[1:]) for c in kept]), terms)

    @classmethod
    def chosen(cls, condition: Mask, one: "Series", other: "Series") -> "Series":
        """Return one where the condition holds and the other elsewhere."""
        terms = max(len(one), len(other))
        return cls.of([Balls.chosen(condition, one[k], other[k]) for k in range(terms)], one.terms)

    def __getitem__(self, k: int) -> Balls:
        return Balls(self.mid[k], self.rad[k]) if k < len(self) else Balls.exact(np.zeros_like(self.mid[0]))

    def __len__(self) -> int:
        return len(self.mid)

    @property
    def coefficients(self) -> Balls:
        """The stored coefficients, of shape (d, P)."""
        return Balls(self.mid, self.rad)

    def _with(self, coefficients: Balls) -> Self:
        return type(self)(coefficients.mid, np.broadcast_to(coefficients.rad, coefficients.mid.shape), self.terms)

    def __add__(self, other: Any) -> Self:
        if not isinstance(other, Series):
            return type(self).of([self[0] + other, *(self[k] for k in range(1, len(self)))], self.terms)
        short, long = (self, other) if len(self) <= len(other) else (other, self)
        low = short.coefficients + Balls(long.mid[: len(short)], long.rad[: len(short)])
        mid, rad = np.concatenate([low.mid, long.mid[len(short) :]]), np.concatenate([low.rad, long.rad[len(short) :]])
        return type(self)(mid, rad, self.terms)

    def __neg__(self) -> Self:
        return self._with(-self.coefficients)

    def __sub__(self, other: Any) -> Self:
        found: Self = self + -other
        return found

    def __rsub__(self, other: Any) -> Self:
        found: Self = -self + other
        return found

    def __mul__(self, other: Any) -> Self:
        if isinstance(other, Series):
            return self._product(other)
        return self._with(self.coefficients * other)

    def __truediv__(self, other: Any) -> Self:
        return self._with(self.coefficients / other)

    __radd__ = __add__
    __rmul__ = __mul__

    def _product(self, other: "Series") -> Self:
        """Return the product: Σ_j a_j b_(k − j), with its rounding bounded by that of the sum of |a_j b_(k − j)|."""
        short, long = (self, other) if len(self) <= len(other) else (other, self)
        count = min(len(short) + len(long) - 1, self.terms)
        mid = np.zeros((count, *np.broadcast_shapes(short.mid.shape[1:], long.mid.shape[1:])))
        rad = np.zeros_like(mid)
        size = np.abs(long.mid)
        rounded = long.rad + (len(short) + 4) * U * size
        whole = size + long.rad
        for j in range(len(short)):
            kept = min(len(long), count - j)
            at = slice(j, j + kept)
            mid[at] += short.mid[j] * long.mid[:kept]
            rad[at] += np.abs(short.mid[j]) * rounded[:kept] + short.rad[j] * whole[:kept]
        return type(self)(mid, sums_up(rad, 2 * len(short)), self.terms)

    def exp(self) -> Self:
        """Return e^a: its coefficients fulfil k e_k = Σ_(0 < j ≤ k) j a_j e_(k − j)."""
        weighted, found = self._derivative, _Growing.of(self[0].exp(), self.terms)
        for k in range(1, self.terms):
            found.put(k, found.against(weighted, k) * _reciprocal(k))
        return self._with(found.coefficients)

    def cos(self) -> Self:
        """Return cos(a₀ + a₁ x), of linear series: the derivatives of cos at a₀."""
        assert len(self) <= 2, "only cosines of linear series are needed"
        cosine, sine = self[0].cos(), (self[0] - _QUARTER).cos()
        turn, power, found = (cosine, -sine, -cosine, sine), Balls.exact(np.ones_like(self.mid[0])), [cosine]
        for k in range(1, self.terms if len(self) > 1 else 1):
            power = power * self[1] * _reciprocal(k)
            found.append(turn[k % 4] * power)
        return type(self).of(found, self.terms)

    def log(self) -> Self:
        """Return ln a: its coefficients fulfil a₀ k l_k = k a_k − Σ_(0 < j < k) a_j (k − j) l_(k − j)."""
        inverse, rest, weighted = self[0].inverse(), self.coefficients.at(slice(1, None)), self._derivative
        found = _Growing.of(Balls.exact(np.zeros_like(self.mid[0])), self.terms)  # k l_k
        for k in range(1, self.terms):
            known = found.against(rest, k)
            found.put(k, ((weighted.at(k - 1) - known) if k < len(self) else -known) * inverse)
        return type(self).of(
            [self[0].log(), *(found.coefficients.at(k) * _reciprocal(k) for k in range(1, self.terms))], self.terms
        )

    @property
    def _derivative(self) -> Balls:
        """The coefficients j a_j from j = 1 on."""
        return (self.coefficients * np.arange(float(len(self)))[:, None]).at(slice(1, None))


@dataclass(frozen=True, eq=False)
class _Growing:
    """Coefficients that are computed one after the other; zero as long as they are not."""

    coefficients: Balls

    @classmethod
    def of(cls, first: Balls, terms: int) -> Self:
        found = cls(Balls(*np.zeros((2, terms, *first.mid.shape))))
        found.put(0, first)
        return found

    def put(self, k: int, coefficient: Balls) -> None:
        self.coefficients.mid[k], self.coefficients.rad[k] = coefficient.mid, coefficient.rad

    def against(self, factors: Balls, k: int) -> Balls:
        """Return Σ_(0 < j ≤ k) a_j e_(k − j), for the `factors` a_1, a_2, …"""
        count = min(k, len(factors.mid))
        a, a_rad = factors.mid[:count], factors.rad[:count]
        e, e_rad = (x[k - count : k][::-1] for x in (self.coefficients.mid, self.coefficients.rad))
        size = np.abs(e)
        off = np.abs(a) * (e_rad + (count + 4) * U * size) + a_rad * (size + e_rad)
        return Balls(np.sum(a * e, axis=0), sums_up(np.sum(off, axis=0), 2 * count))


def exponential_terms(x: Balls, terms: int) -> Balls:
    """Return xᵏ/k! for all k < terms, of balls of shape (P,): shape (terms, P).

    With m the middle of x and s ≥ |x|: |xᵏ − mᵏ| ≤ |x − m| k s^(k − 1). Each factor m/k is rounded, and each product.
    Where powers underflow, all factors that follow are smaller than 1.
    """
    k = np.arange(1.0, terms)[:, None]
    ones = np.ones((1, *x.mid.shape))
    mid, size = (np.multiply.accumulate(np.concatenate([ones, each / k])) for each in (x.mid, x.size))
    rad = np.zeros_like(mid)
    rad[1:] = sums_up(x.rad * size[:-1] + 3 * U * k * size[1:], 2 * terms)
    return Balls(mid, rad)


@cache
def _reciprocal(k: int) -> Balls:
    """Return 1/k."""
    return Balls.of(arb(1)) / k


_QUARTER = arb("1.5707963267948966192313216916397514420985846996875529104874722961 +/- 1e-60")
"""π/2."""
