"""κ(r) = θ₁² exp(−r²/(2 θ₂²))."""

from dataclasses import dataclass

from trackably.checker.arithmetic.intervals import Real, exp
from trackably.checker.arithmetic.series import exp_series
from trackably.checker.kernels.base import Decay, Sizes
from trackably.checker.kernels.elementary import Elementary


@dataclass(frozen=True)
class SquaredExponential(Elementary):
    """κ(r) = θ₁² exp(−r²/(2 θ₂²)); |κ̇| is largest at r = θ₂."""

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        p = 2 * self.length**2
        return self.scaled(exp_series([-(r**2) / p, -2 * r * h / p, -(h**2) / p], n))

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        # |Im z| ≤ radius on the disc, and so Re z² ≥ r²/2 − radius².
        square = (r**2 / 2 - radius**2) / self.length**2
        return self.variance * exp(-square / 2)

    def beyond(self, distance: Real) -> Decay:
        return self.falling(distance, self.length)

    def sizes(self, farthest: Real) -> Sizes:
        # With x = r/θ₂: x² e^(−x²/2) ≤ 1 and x e^(−x²/2) ≤ 0.607.
        size, slope = self.peak
        return Sizes(size, slope, size, size * self.length * 0.607, 30 * size)
