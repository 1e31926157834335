"""Matérn kernels κ(r) = θ₁² P(x) e^(−x), with x = √3 r/θ₂ or √5 r/θ₂ for the branch of r ≥ 0."""

from dataclasses import dataclass

from trackable.checker.arithmetic.intervals import ONE, ZERO, Real, exp, root
from trackable.checker.arithmetic.series import exp_series, times
from trackable.checker.kernels.base import Decay, Sizes
from trackable.checker.kernels.elementary import Elementary


@dataclass(frozen=True)
class Matern32(Elementary):
    """P(x) = 1 + x with x = √3 r/θ₂; |κ̇| is largest at r = θ₂/√3."""

    @property
    def has_kink(self) -> bool:
        return True

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        rate = root(3) / self.length
        x, y = rate * r, rate * h
        return self.scaled(times([1 + x, y], exp_series([-x, -y], n), n))

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        rate = root(3) / self.length
        x = rate * (abs(r) + radius)
        return self.variance * (1 + x) * exp(rate * (radius - abs(r)))

    def beyond(self, distance: Real) -> Decay:
        return self.falling(distance, self.length * (ONE / root(3)))

    def sizes(self, farthest: Real) -> Sizes:
        size, slope = self.beyond(ZERO)
        # x² e^(−x) ≤ 1 and x (1 + x) e^(−x) ≤ 0.841
        return Sizes(size, slope, size, size * self.length * (0.841 / 1.732), 30 * size)


@dataclass(frozen=True)
class Matern52(Elementary):
    """P(x) = 1 + x + x²/3 with x = √5 r/θ₂; |κ̇| is largest at r = θ₂ (1 + √5)/(2 √5)."""

    @property
    def has_kink(self) -> bool:
        return True

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        rate = root(5) / self.length
        x, y = rate * r, rate * h
        return self.scaled(times([1 + x + x**2 / 3, y + 2 * x * y / 3, y**2 / 3], exp_series([-x, -y], n), n))

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        rate = root(5) / self.length
        x = rate * (abs(r) + radius)
        return self.variance * (1 + x + x**2 / 3) * exp(rate * (radius - abs(r)))

    def beyond(self, distance: Real) -> Decay:
        return self.falling(distance, self.length * ((1 + root(5)) / (2 * root(5))))

    def sizes(self, farthest: Real) -> Sizes:
        size, slope = self.beyond(ZERO)
        # x² (1 + x) e^(−x)/3 ≤ 1 and x (1 + x + x²/3) e^(−x) ≤ 1.176
        return Sizes(size, slope, size, size * self.length * (1.176 / 2.236), 30 * size)
