"""Matérn kernels in ball arithmetic: κ(r) = θ₁² P(x) e^(−x) for the branch of r ≥ 0."""

from flint import arb

from trackable.certificates.floats.choice import Number, PowerSeries
from trackable.certificates.kernels.elementary import RadialBalls


class Matern32Balls(RadialBalls):
    """P(x) = 1 + x with x = √3 r/θ₂."""

    @property
    def kinks(self) -> tuple[float, ...]:
        return (0.0,)

    def taylor(self, r: PowerSeries) -> PowerSeries:
        x = r * (arb(3).sqrt() / self.length)
        return (1 + x) * (-x).exp() * self.variance

    def on_disc(self, r: Number, radius: Number) -> Number:
        rate = arb(3).sqrt() / self.length
        size = rate * (abs(r) + radius)
        return self.variance * (1 + size) * (rate * (radius - abs(r))).exp()

    @property
    def steepest(self) -> arb:
        return self.length / arb(3).sqrt()

    def moment(self, reach: arb, size: arb) -> arb:
        # x (1 + x) e^(−x) ≤ 0.85
        return size * self.length / arb(3).sqrt() * arb(85) / 100


class Matern52Balls(RadialBalls):
    """P(x) = 1 + x + x²/3 with x = √5 r/θ₂."""

    @property
    def kinks(self) -> tuple[float, ...]:
        return (0.0,)

    def taylor(self, r: PowerSeries) -> PowerSeries:
        x = r * (arb(5).sqrt() / self.length)
        return (1 + x + x * x / 3) * (-x).exp() * self.variance

    def on_disc(self, r: Number, radius: Number) -> Number:
        rate = arb(5).sqrt() / self.length
        size = rate * (abs(r) + radius)
        return self.variance * (1 + size + size**2 / 3) * (rate * (radius - abs(r))).exp()

    @property
    def steepest(self) -> arb:
        return self.length * (1 + arb(5).sqrt()) / (2 * arb(5).sqrt())

    def moment(self, reach: arb, size: arb) -> arb:
        # x (1 + x + x²/3) e^(−x) ≤ 1.18
        return size * self.length / arb(5).sqrt() * arb(118) / 100
