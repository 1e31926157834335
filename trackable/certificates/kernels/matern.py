"""Matérn kernels in ball arithmetic: κ(r) = θ₁² P(x) e^(−x) for the branch of r ≥ 0."""

from abc import abstractmethod
from functools import cached_property

from flint import arb

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.floats.choice import Number, PowerSeries
from trackable.certificates.kernels.elementary import RadialBalls


class MaternBalls(RadialBalls):
    """κ(r) = θ₁² P(x) e^(−x) with x = a r."""

    @property
    def kinks(self) -> tuple[float, ...]:
        return (0.0,)

    @cached_property
    @abstractmethod
    def rate(self) -> arb:
        """a [1/s]."""

    @cached_property
    @abstractmethod
    def powers(self) -> tuple[arb, ...]:
        """The coefficients of P, from 1 on."""


class Matern32Balls(MaternBalls):
    """P(x) = 1 + x with x = √3 r/θ₂."""

    @cached_property
    def rate(self) -> arb:
        with ball_arithmetic():
            return arb(3).sqrt() / self.length

    @cached_property
    def powers(self) -> tuple[arb, ...]:
        return arb(1), arb(1)

    def taylor(self, r: PowerSeries) -> PowerSeries:
        x = r * self.rate
        return (1 + x) * (-x).exp() * self.variance

    def on_disc(self, r: Number, radius: Number) -> Number:
        size = self.rate * (abs(r) + radius)
        return self.variance * (1 + size) * (self.rate * (radius - abs(r))).exp()

    @property
    def steepest(self) -> arb:
        return self.length / arb(3).sqrt()

    def moment(self, reach: arb, size: arb) -> arb:
        # x (1 + x) e^(−x) ≤ 0.85
        return size * self.length / arb(3).sqrt() * arb(85) / 100


class Matern52Balls(MaternBalls):
    """P(x) = 1 + x + x²/3 with x = √5 r/θ₂."""

    @cached_property
    def rate(self) -> arb:
        with ball_arithmetic():
            return arb(5).sqrt() / self.length

    @cached_property
    def powers(self) -> tuple[arb, ...]:
        with ball_arithmetic():
            return arb(1), arb(1), arb(1) / 3

    def taylor(self, r: PowerSeries) -> PowerSeries:
        x = r * self.rate
        return (1 + x + x * x / 3) * (-x).exp() * self.variance

    def on_disc(self, r: Number, radius: Number) -> Number:
        size = self.rate * (abs(r) + radius)
        return self.variance * (1 + size + size**2 / 3) * (self.rate * (radius - abs(r))).exp()

    @property
    def steepest(self) -> arb:
        return self.length * (1 + arb(5).sqrt()) / (2 * arb(5).sqrt())

    def moment(self, reach: arb, size: arb) -> arb:
        # x (1 + x + x²/3) e^(−x) ≤ 1.18
        return size * self.length / arb(5).sqrt() * arb(118) / 100
