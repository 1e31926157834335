"""κ(r) = θ₁² exp(−r²/(2 θ₂²)) in ball arithmetic."""

from flint import arb, arb_series

from trackable.certificates.kernels.elementary import RadialBalls, least_square


class SquaredExponentialBalls(RadialBalls):
    """κ(r) = θ₁² exp(−r²/(2 θ₂²))."""

    def exponential(self, r: arb_series) -> tuple[arb, arb_series]:
        s = r / self.length
        return self.variance, s * s / -2

    def taylor(self, r: arb_series) -> arb_series:
        size, exponent = self.exponential(r)
        return exponent.exp() * size

    def on_disc(self, r: arb, radius: arb) -> arb:
        return self.variance * (-least_square(r, radius) / (2 * self.squared_length)).exp()

    @property
    def steepest(self) -> arb:
        return self.length

    def moment(self, reach: arb, size: arb) -> arb:
        # x e^(−x²/2) is largest at x = 1.
        return size * self.length * (arb(-1) / 2).exp()
