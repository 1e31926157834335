"""κ(r) = θ₁² exp(−r²/(2 θ₂²)) in ball arithmetic."""

import numpy as np
from flint import arb

from trackable.certificates.floats.choice import Number, PowerSeries
from trackable.certificates.kernels.base import Decay
from trackable.certificates.kernels.elementary import RadialBalls, least_square


class SquaredExponentialBalls(RadialBalls):
    """κ(r) = θ₁² exp(−r²/(2 θ₂²))."""

    def exponential(self, r: PowerSeries) -> tuple[arb, PowerSeries]:
        s = r / self.length
        return self.variance, s * s / -2

    def taylor(self, r: PowerSeries) -> PowerSeries:
        size, exponent = self.exponential(r)
        return exponent.exp() * size

    def on_disc(self, r: Number, radius: Number) -> Number:
        return self.variance * (-least_square(r, radius) / (2 * self.squared_length)).exp()

    def beyond(self, distance: Number) -> Decay[Number]:
        # |κ̇| = |r| κ/θ₂²
        steepest = distance.max(self.length)
        there = self._at(steepest)
        size = there if np.all(distance >= self.length) else self._at(distance)
        return Decay(size, there * steepest / self.squared_length)

    def _at(self, r: Number) -> Number:
        return self.variance * (r**2 / (-2 * self.squared_length)).exp()

    @property
    def steepest(self) -> arb:
        return self.length

    def moment(self, reach: arb, size: arb) -> arb:
        # x e^(−x²/2) is largest at x = 1.
        return size * self.length * (arb(-1) / 2).exp()
