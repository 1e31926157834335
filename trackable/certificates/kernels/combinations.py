"""Sums and products of kernels in ball arithmetic."""

from dataclasses import dataclass

from flint import arb

from trackable.certificates.floats.choice import Number, PowerSeries, choose, zero
from trackable.certificates.kernels.base import Decay, KernelBalls, Sensitivity


@dataclass(frozen=True)
class CombinationBalls(KernelBalls):
    """Two kernels, `left` and `right`."""

    left: KernelBalls
    right: KernelBalls

    @property
    def kinks(self) -> tuple[float, ...]:
        return tuple(sorted({*self.left.kinks, *self.right.kinks}))

    @property
    def has_periodic_part(self) -> bool:
        return self.left.has_periodic_part or self.right.has_periodic_part


class SumBalls(CombinationBalls):
    """κ = κ₁ + κ₂."""

    def taylor(self, r: PowerSeries) -> PowerSeries:
        return self.left.taylor(r) + self.right.taylor(r)

    def on_disc(self, r: Number, radius: Number) -> Number:
        return self.left.on_disc(r, radius) + self.right.on_disc(r, radius)

    def far(self, distance: Number, radius: Number) -> Number:
        return self.left.far(distance, radius) + self.right.far(distance, radius)

    def jump(self, r: Number, half: Number) -> Number:
        return self.left.jump(r, half) + self.right.jump(r, half)

    def beyond(self, distance: Number) -> Decay[Number]:
        f, g = self.left.beyond(distance), self.right.beyond(distance)
        return Decay(f.size + g.size, f.slope + g.slope)

    def sensitivity(self, reach: arb) -> Sensitivity:
        f, g = self.left.sensitivity(reach), self.right.sensitivity(reach)
        size = f.size + g.size
        return Sensitivity(
            size, f.slope + g.slope, f.stretch + g.stretch, f.moment + g.moment, f.formula + g.formula + 2 * size
        )


class ProductBalls(CombinationBalls):
    """κ = κ₁ κ₂."""

    def exponential(self, r: PowerSeries) -> tuple[arb, PowerSeries] | None:
        left, right = self.left.exponential(r), self.right.exponential(r)
        return (left[0] * right[0], left[1] + right[1]) if left and right else None

    def taylor(self, r: PowerSeries) -> PowerSeries:
        # One exponential takes half the time of two and their product.
        if found := self.exponential(r):
            size, exponent = found
            return exponent.exp() * size
        return self.left.taylor(r) * self.right.taylor(r)

    def on_disc(self, r: Number, radius: Number) -> Number:
        return self.left.on_disc(r, radius) * self.right.on_disc(r, radius)

    def far(self, distance: Number, radius: Number) -> Number:
        return self.left.far(distance, radius) * self.right.far(distance, radius)

    def jump(self, r: Number, half: Number) -> Number:
        # κ₁ κ₂ − b₁ b₂ = (κ₁ − b₁) κ₂ + b₁ (κ₂ − b₂) with the branches b at r
        f, g = self.left.jump(r, half), self.right.jump(r, half)
        left = choose(f.is_zero(), zero(r), f * self.right.beyond(arb(0)).size)
        return left + choose(g.is_zero(), zero(r), self.left.on_disc(r, half) * g)

    def beyond(self, distance: Number) -> Decay[Number]:
        f, g = self.left.beyond(distance), self.right.beyond(distance)
        return Decay(f.size * g.size, f.slope * g.size + f.size * g.slope)

    def sensitivity(self, reach: arb) -> Sensitivity:
        f, g = self.left.sensitivity(reach), self.right.sensitivity(reach)
        size = f.size * g.size
        return Sensitivity(
            size,
            f.slope * g.size + f.size * g.slope,
            # Of a factor that does not decay only what the other one leaves of it far out.
            (f.stretch * g.size).min(f.slope * g.moment) + (f.size * g.stretch).min(f.moment * g.slope),
            (f.moment * g.size).min(f.size * g.moment),
            f.formula * g.size + f.size * g.formula + 2 * size,
        )
