"""κ(r) = θ₁² exp(−(2/θ₂²) sin²(π r/θ₃)) = θ₁² exp((cos ωr − 1)/θ₂²) with ω = 2π/θ₃."""

from dataclasses import dataclass

from trackably.checker.arithmetic.intervals import SIGN, Real, chosen, cos, exactly, exp, pi, sin
from trackably.checker.arithmetic.series import exp_series
from trackably.checker.kernels.base import Decay, Sizes
from trackably.checker.kernels.elementary import Elementary


@dataclass(frozen=True)
class Periodic(Elementary):
    """κ(r) = θ₁² exp((cos ωr − 1)/θ₂²) with ω = 2π/θ₃ and `period` θ₃; it never decays."""

    period: float

    @property
    def omega(self) -> Real:
        """ω."""
        return 2 * pi() / exactly(self.period)

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        omega = self.omega
        cosine, sine = cos(omega * r), sin(omega * r)
        turn, step, scale = (cosine, -sine, -cosine, sine), omega * h, [1 / self.length**2]
        for k in range(1, n):
            scale.append(scale[-1] * step / k)
        g = [turn[k % 4] * scale[k] for k in range(n)]
        return self.scaled(exp_series([g[0] - scale[0], *g[1:]], n))

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        # Re cos(x + iy) = cos x cosh y
        cosine, reach = cos(self.omega * (r + radius * SIGN)).b, self.omega * radius
        largest = chosen(cosine <= 0, cosine, cosine * (exp(reach) + exp(-reach)) / 2)
        return self.variance * exp((largest - 1) / self.length**2)

    def beyond(self, distance: Real) -> Decay:
        # |sin v| e^((cos v − 1)/θ₂²)/θ₂² ≤ e^(−1/2)/θ₂
        return Decay(self.variance, self.variance * self.omega * exp(exactly(-0.5)) / self.length)

    def sizes(self, farthest: Real) -> Sizes:
        size, slope = self.peak
        return Sizes(size, slope, farthest * slope, farthest * size, 30 * size)

    @property
    def repeats_after(self) -> float:
        return self.period
