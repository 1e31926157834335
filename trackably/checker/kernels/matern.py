"""Matérn kernels κ(r) = θ₁² P(x) e^(−x) with x = λ r, for the branch of r ≥ 0; λ is √3/θ₂ or √5/θ₂.

Sums of them with all centres before t are of the same form. Let a be a time with t_i ≤ a ≤ t, u = t − a and
v_i = λ (a − t_i). By Taylor's formula, P(λu + v) = Σ_k P⁽ᵏ⁾(λu) vᵏ/k!, which ends with the degree of P. So
Σ_i c_i κ(t − t_i) = θ₁² e^(−λu) Σ_k m_k P⁽ᵏ⁾(λu), with the moments m_k = Σ_i c_i v_iᵏ/k! e^(−v_i). A single kernel has
a = t_i, and the moments 1, 0, …
"""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from trackably.checker.arithmetic.intervals import ONE, Real, exp, root, total
from trackably.checker.arithmetic.series import exp_series, times
from trackably.checker.kernels.base import Decay, Sizes
from trackably.checker.kernels.elementary import Elementary


@dataclass(frozen=True)
class Matern(Elementary):
    """P has no negative coefficients, and this `degree`; `square` is (λ θ₂)²."""

    degree: ClassVar[int]
    square: ClassVar[int]

    @property
    def has_kink(self) -> bool:
        return True

    @cached_property
    def rate(self) -> Real:
        """λ."""
        return root(self.square) / self.length

    @abstractmethod
    def slopes(self, x: Real) -> list[Real]:
        """Return P(x), P'(x), … up to the last one that is not 0."""

    def along(self, moments: Sequence[Real], x: Real, y: Real, n: int) -> list[Real]:
        """Return n coefficients in ξ of θ₁² e^(−z) Σ_k m_k P⁽ᵏ⁾(z) with z = x + y ξ."""
        slopes, power = self.slopes(x), ONE
        found: list[Real] = []
        for j in range(len(slopes)):
            found.append(total(m * slope for m, slope in zip(moments, slopes[j:], strict=False)) * power)
            power = y * power / (j + 1)
        return self.scaled(times(found, exp_series([-x, -y], n), n))

    def largest_around(self, moments: Sequence[Real], x: Real, y: Real) -> Real:
        """Over-estimate |θ₁² e^(−z) Σ_k m_k P⁽ᵏ⁾(z)| on |z − x| < y, for moments of |c_i|: |P⁽ᵏ⁾(z)| ≤ P⁽ᵏ⁾(|z|)."""
        shape = total(m * slope for m, slope in zip(moments, self.slopes(x + y), strict=False))
        return self.variance * shape * exp(y - x)

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        return self.along([ONE], self.rate * r, self.rate * h, n)

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        return self.largest_around([ONE], self.rate * abs(r), self.rate * radius)


@dataclass(frozen=True)
class Matern32(Matern):
    """P(x) = 1 + x with x = √3 r/θ₂; |κ̇| is largest at r = θ₂/√3."""

    degree, square = 1, 3

    def slopes(self, x: Real) -> list[Real]:
        return [1 + x, ONE]

    def beyond(self, distance: Real) -> Decay:
        return self.falling(distance, self.length * (ONE / root(3)))

    def sizes(self, farthest: Real) -> Sizes:
        size, slope = self.peak
        # x² e^(−x) ≤ 1 and x (1 + x) e^(−x) ≤ 0.841
        return Sizes(size, slope, size, size * self.length * (0.841 / 1.732), 30 * size)


@dataclass(frozen=True)
class Matern52(Matern):
    """P(x) = 1 + x + x²/3 with x = √5 r/θ₂; |κ̇| is largest at r = θ₂ (1 + √5)/(2 √5)."""

    degree, square = 2, 5

    def slopes(self, x: Real) -> list[Real]:
        return [1 + x + x**2 / 3, 1 + 2 * x / 3, ONE * 2 / 3]

    def beyond(self, distance: Real) -> Decay:
        return self.falling(distance, self.length * ((1 + root(5)) / (2 * root(5))))

    def sizes(self, farthest: Real) -> Sizes:
        size, slope = self.peak
        # x² (1 + x) e^(−x)/3 ≤ 1 and x (1 + x + x²/3) e^(−x) ≤ 1.176
        return Sizes(size, slope, size, size * self.length * (1.176 / 2.236), 30 * size)
