"""Piecewise polynomial kernels in ball arithmetic: a polynomial for r < θ₂, and zero from θ₂ on."""

from typing import Any, ClassVar, TypeVar

import numpy as np
from flint import arb, arb_series

from trackable.certificates.floats.balls import Balls
from trackable.certificates.floats.choice import Number, PowerSeries, choose, zero
from trackable.certificates.floats.series import Series
from trackable.certificates.kernels.base import Decay
from trackable.certificates.kernels.elementary import RadialBalls

_X = TypeVar("_X", arb, arb_series, Balls, Series)


class PiecewisePolynomialBalls(RadialBalls):
    """κ(r) = θ₁² (1 − s)ᵖ Q(s) with s = |r|/θ₂ < 1, Q with positive `coefficients` from s⁰ on; zero for s ≥ 1.

    Two branches hold for positive differences: the polynomial, and zero. Each is entire.
    """

    power: ClassVar[int]
    coefficients: ClassVar[tuple[int, ...]]

    @property
    def kinks(self) -> tuple[float, ...]:
        return 0.0, self.lengthscale

    def taylor(self, r: PowerSeries) -> PowerSeries:
        return choose(self._is_inside(r[0]), self._polynomial(r / self.length), r * 0)

    def on_disc(self, r: Number, radius: Number) -> Number:
        # |1 − z| ≤ |1 − s| + ρ and |Q(z)| ≤ Q(s + ρ) on |z − s| ≤ ρ.
        s, rho = abs(r) / self.length, radius / self.length
        found = self.variance * self._powered(abs(1 - s) + rho) * self._factor(s + rho)
        return choose(self._is_inside(r), found, zero(r))

    def far(self, distance: Number, radius: Number) -> Number:
        return choose(distance - radius > self.length, zero(distance), arb.pos_inf())

    def beyond(self, distance: Number) -> Decay[Number]:
        size, slope = super().beyond(distance)
        at_rest = distance > self.length
        return Decay(choose(at_rest, zero(size), size), choose(at_rest, zero(slope), slope))

    def jump(self, r: Number, half: Number) -> Number:
        # |(1 − s)ᵖ Q(s)| falls up to s = 1 and rises from there on: it is largest at the end that is farther from 1.
        end, start = abs(r) + half, (abs(r) - half).max(arb(0))
        beyond = choose(end <= self.length, zero(r), self._size(end))
        before = choose(start >= self.length, zero(r), self._size(start))
        return choose(self._is_inside(r), beyond, before)

    def moment(self, reach: arb, size: arb) -> arb:
        # s φ(s) ≤ 0.165
        return size * self.length * arb(17) / 100

    def _is_inside(self, r: Number) -> Any:
        """Return whether the polynomial is the branch at |r|, as it is at θ₂ and where no branch holds for certain."""
        return np.logical_not(abs(r) > self.length)

    def _size(self, r: Number) -> Number:
        return abs(self._polynomial(r / self.length))

    def _polynomial(self, s: _X) -> _X:
        return self._powered(1 - s) * self._factor(s) * self.variance

    def _powered(self, y: _X) -> _X:
        """yᵖ by multiplication, which balls around zero allow."""
        found = y
        for _ in range(self.power - 1):
            found = found * y
        return found

    def _factor(self, s: _X) -> _X:
        """Q, by Horner's rule."""
        found = s * 0
        for coefficient in reversed(self.coefficients):
            found = found * s + coefficient
        return found


class PiecewisePolynomial2Balls(PiecewisePolynomialBalls):
    """κ(r) = θ₁² (1 − s)⁵ (8 s² + 5 s + 1)."""

    power = 5
    coefficients = (1, 5, 8)

    @property
    def steepest(self) -> arb:
        return self.length * (3 + arb(105).sqrt()) / 48


class PiecewisePolynomial3Balls(PiecewisePolynomialBalls):
    """κ(r) = θ₁² (1 − s)⁷ (21 s³ + 19 s² + 7 s + 1)."""

    power = 7
    coefficients = (1, 7, 19, 21)

    @property
    def steepest(self) -> arb:
        # The root of 105 s³ + 13 s² − 5 s − 1 lies in this ball.
        return self.length * arb("0.239983490293579 +/- 1e-14")
