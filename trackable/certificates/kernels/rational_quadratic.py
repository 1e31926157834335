"""κ(r) = θ₁² (1 + r²/(2 α θ₂²))^(−α) in ball arithmetic."""

from dataclasses import dataclass

from flint import arb

from trackable.certificates.floats.choice import Number, PowerSeries, choose
from trackable.certificates.kernels.elementary import RadialBalls, least_square


@dataclass(frozen=True)
class RationalQuadraticBalls(RadialBalls):
    """κ(r) = θ₁² (1 + r²/(2 α θ₂²))^(−α) with `shape` α."""

    shape: float

    @property
    def alpha(self) -> arb:
        """α."""
        return arb(self.shape)

    def taylor(self, r: PowerSeries) -> PowerSeries:
        s, alpha = r / self.length, self.alpha
        return ((1 + s * s / (2 * alpha)).log() * -alpha).exp() * self.variance

    def on_disc(self, r: Number, radius: Number) -> Number:
        q = 1 + least_square(r, radius) / (2 * self.alpha * self.length**2)  # ≤ Re q(z) ≤ |q(z)|
        return choose(q > 0, self.variance * (q.log() * -self.alpha).exp(), arb.pos_inf())

    @property
    def steepest(self) -> arb:
        return self.length * (2 * self.alpha / (2 * self.alpha + 1)).sqrt()

    @property
    def roundings(self) -> arb:
        return super().roundings + 8 * self.alpha  # the power −α of a rounded base
