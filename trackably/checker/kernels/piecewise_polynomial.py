"""Piecewise polynomial kernels: κ(r) = θ₁² P(y) with y = 1 − |r|/θ₂ while that is positive, and 0 from |r| = θ₂ on."""

from dataclasses import dataclass
from typing import ClassVar

from trackably.checker.arithmetic.intervals import ONE, ZERO, Real, between, chosen, exactly, root, total
from trackably.checker.arithmetic.series import times
from trackably.checker.kernels.base import Decay, Sizes
from trackably.checker.kernels.elementary import Elementary


@dataclass(frozen=True)
class PiecewisePolynomial(Elementary):
    """P(y) = Σ_j `p`[j] yʲ; on 0 ≤ y ≤ 1 it rises from 0 to 1, and |P| rises with |y| for y ≤ 0."""

    p: ClassVar[tuple[int, ...]]
    steepest_at: ClassVar[Real]
    """s = |r|/θ₂ where |κ̇| is largest."""

    @property
    def has_kink(self) -> bool:
        return True

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        y = [1 - r / self.length, -h / self.length]
        found: list[Real] = []
        for coefficient in reversed(self.p):  # Horner's rule; the degree grows by one in each step
            found = times(found, y, min(len(found) + 1, n))
            found[0] += coefficient
        is_over = self._is_over(r)
        return [*(chosen(is_over, ZERO, c) for c in self.scaled(found)), *[ZERO] * (n - len(found))]

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        # no larger than the sum of the sizes of its Taylor terms, of which there are no more
        return total(abs(c) for c in self.taylor(abs(r), radius, len(self.p)))

    def jump(self, r: Real, h: Real) -> Real:
        beyond, farthest = abs(r) - h, abs(r) + h
        nearest = (beyond + abs(beyond)) / 2  # no less than 0
        from_zero = chosen(self.length <= nearest.a, ZERO, abs(self.taylor(nearest, ZERO, 1)[0]))
        y = 1 - farthest / self.length
        from_polynomial = self.variance * abs(total(c * y**j for j, c in enumerate(self.p) if c))
        return chosen(self._is_over(r), from_zero, chosen(farthest.b <= self.length, ZERO, from_polynomial))

    def beyond(self, distance: Real) -> Decay:
        return self.falling(distance, self.length * self.steepest_at)

    def sizes(self, farthest: Real) -> Sizes:
        # With s = |r|/θ₂: s |φ'| ≤ 0.756 and s φ ≤ 0.165. Products of up to 7 factors 1 − s, Q by Horner's rule, θ₁².
        size, slope = self.peak
        return Sizes(size, slope, size, size * self.length * 0.165, 35 * size)

    def _is_over(self, r: Real) -> bool | None:
        """Return whether |r| > θ₂ for certain: then the branch is 0, otherwise the polynomial."""
        return abs(r).a > self.length


class PiecewisePolynomial2(PiecewisePolynomial):
    """P(y) = 14 y⁵ − 21 y⁶ + 8 y⁷, that is (1 − s)⁵ (8 s² + 5 s + 1); P'' = 14 y³ (24 y² − 45 y + 20)."""

    p = (0, 0, 0, 0, 0, 14, -21, 8)
    steepest_at = ONE - (45 - root(105)) / 48


class PiecewisePolynomial3(PiecewisePolynomial):
    """P(y) = 48 y⁷ − 108 y⁸ + 82 y⁹ − 21 y¹⁰, that is (1 − s)⁷ (21 s³ + 19 s² + 7 s + 1).

    P'' = 18 y⁵ (112 − 336 y + 328 y² − 105 y³), and the last factor has a single root, 0.760016….
    """

    p = (0, 0, 0, 0, 0, 0, 0, 48, -108, 82, -21)
    steepest_at = between(exactly(0.2399834902935789), exactly(0.239983490293579))
