"""κ(r) = θ₁² exp((cos ωr − 1)/θ₂²) with ω = 2π/θ₃ in ball arithmetic."""

from dataclasses import dataclass
from functools import cached_property

from flint import arb

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.floats.choice import Number, PowerSeries, choose, zero
from trackable.certificates.kernels.base import Decay, Sensitivity
from trackable.certificates.kernels.elementary import FORMULA, ElementaryBalls


@dataclass(frozen=True)
class PeriodicBalls(ElementaryBalls):
    """κ(r) = θ₁² exp((cos ωr − 1)/θ₂²) with ω = 2π/θ₃, as 2 sin²(π r/θ₃) = 1 − cos ωr; it never decays."""

    period: float

    @cached_property
    def omega(self) -> arb:
        """ω."""
        with ball_arithmetic():
            return 2 * arb.pi() / arb(self.period)

    @property
    def has_periodic_part(self) -> bool:
        return True

    def exponential(self, r: PowerSeries) -> tuple[arb, PowerSeries]:
        return self.variance, ((r * self.omega).cos() - 1) / self.squared_length

    def taylor(self, r: PowerSeries) -> PowerSeries:
        size, exponent = self.exponential(r)
        return exponent.exp() * size

    def on_disc(self, r: Number, radius: Number) -> Number:
        # Re cos(x + iy) = cos x cosh y.
        cosine = (self.omega * (r + radius * arb(0, 1))).cos().upper()
        return self._of_cosine(choose(cosine > 0, cosine * (self.omega * radius).cosh(), cosine))

    def far(self, distance: Number, radius: Number) -> Number:
        return self._of_cosine((self.omega * radius).cosh())

    def _of_cosine(self, cosine: Number) -> Number:
        return self.variance * ((cosine - 1) / self.squared_length).exp()

    def beyond(self, distance: Number) -> Decay[Number]:
        # |κ̇| = κ ω |sin ωr|/θ₂², and √(2v) e^(−v/θ₂²) with v = 1 − cos ωr is largest at v = θ₂²/2.
        everywhere, slope = zero(distance), self.variance * self.omega * (arb(-1) / 2).exp() / self.length
        return Decay(everywhere + self.variance, everywhere + slope)

    def sensitivity(self, reach: arb) -> Sensitivity:
        size, slope = self.largest
        return Sensitivity(size, slope, reach * slope, reach * size, FORMULA * size)
