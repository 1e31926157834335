"""κ(r) = θ₁² (1 + r²/(2 α θ₂²))^(−α)."""

from dataclasses import dataclass

from trackably.checker.arithmetic.intervals import GUARD, INFINITE, ONE, Real, chosen, exactly, exp, iv, log
from trackably.checker.arithmetic.series import power_series
from trackably.checker.kernels.base import Decay, Sizes
from trackably.checker.kernels.elementary import Elementary


@dataclass(frozen=True)
class RationalQuadratic(Elementary):
    """κ(r) = θ₁² (1 + r²/(2 α θ₂²))^(−α) with `shape` α; |κ̇| is largest at r = θ₂ √(2α/(2α + 1))."""

    shape: float

    @property
    def alpha(self) -> Real:
        """α."""
        return exactly(self.shape)

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        p = 2 * self.alpha * self.length**2
        return self.scaled(power_series([1 + r**2 / p, 2 * r * h / p, h**2 / p], -self.alpha, n))

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        # Re z² ≥ r²/2 − radius² on the disc, and so |1 + z²/(2 α θ₂²)| ≥ q.
        square = (r**2 / 2 - radius**2) / self.length**2
        q = 1 + square / (2 * self.alpha)
        is_regular = q.a > 0
        return chosen(is_regular, self.variance * exp(-self.alpha * log(chosen(is_regular, q, ONE))), INFINITE)

    def beyond(self, distance: Real) -> Decay:
        root: Real = iv.sqrt(2 * self.alpha / (2 * self.alpha + 1)) * (1 + GUARD)
        return self.falling(distance, self.length * root)

    def sizes(self, farthest: Real) -> Sizes:
        # With q = 1 + r²/(2 α θ₂²): |r κ̇| = θ₁² 2α (q − 1) q^(−α − 1) ≤ 2 θ₁²/e, where q = (α + 1)/α.
        size, slope = self.peak
        return Sizes(size, slope, size, farthest * size, (30 + 6 * self.alpha) * size)
