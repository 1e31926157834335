"""Sums and products of kernels."""

from dataclasses import dataclass

from trackably.checker.arithmetic.intervals import ZERO, Real, chosen, lesser
from trackably.checker.arithmetic.series import times
from trackably.checker.kernels.base import Decay, Kernel, Sizes


@dataclass(frozen=True)
class Combination(Kernel):
    """Two kernels, `left` and `right`."""

    left: Kernel
    right: Kernel

    @property
    def has_kink(self) -> bool:
        return self.left.has_kink or self.right.has_kink

    @property
    def numbers(self) -> tuple[float, ...]:
        return self.left.numbers + self.right.numbers

    @property
    def repeats_after(self) -> float | None:
        period = self.left.repeats_after
        return period if period == self.right.repeats_after else None


class Sum(Combination):
    """κ = κ₁ + κ₂."""

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        return [x + y for x, y in zip(self.left.taylor(r, h, n), self.right.taylor(r, h, n), strict=True)]

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        return self.left.largest_on_disc(r, radius) + self.right.largest_on_disc(r, radius)

    def jump(self, r: Real, h: Real) -> Real:
        return self.left.jump(r, h) + self.right.jump(r, h)

    def beyond(self, distance: Real) -> Decay:
        f, g = self.left.beyond(distance), self.right.beyond(distance)
        return Decay(f.size + g.size, f.slope + g.slope)

    def sizes(self, farthest: Real) -> Sizes:
        f, g = self.left.sizes(farthest), self.right.sizes(farthest)
        return Sizes(
            f.size + g.size,
            f.slope + g.slope,
            f.stretch + g.stretch,
            f.moment + g.moment,
            f.roundings + g.roundings + f.size + g.size,
        )


class Product(Combination):
    """κ = κ₁ κ₂."""

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        return times(self.left.taylor(r, h, n), self.right.taylor(r, h, n), n)

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        return self.left.largest_on_disc(r, radius) * self.right.largest_on_disc(r, radius)

    def jump(self, r: Real, h: Real) -> Real:
        # κ₁ κ₂ − b₁ b₂ = (κ₁ − b₁) κ₂ + b₁ (κ₂ − b₂) with the branches b at r
        f, g = self.left.jump(r, h), self.right.jump(r, h)
        of_left = chosen(f.b <= 0, ZERO, f * self.right.peak.size)
        return of_left + chosen(g.b <= 0, ZERO, self.left.largest_on_disc(r, h) * g)

    def beyond(self, distance: Real) -> Decay:
        f, g = self.left.beyond(distance), self.right.beyond(distance)
        return Decay(f.size * g.size, f.slope * g.size + f.size * g.slope)

    def sizes(self, farthest: Real) -> Sizes:
        f, g = self.left.sizes(farthest), self.right.sizes(farthest)
        return Sizes(
            f.size * g.size,
            f.slope * g.size + f.size * g.slope,
            # |r κ̇|: of a factor that does not decay only what the other one leaves of it
            lesser(f.stretch * g.size, f.slope * g.moment) + lesser(f.size * g.stretch, f.moment * g.slope),
            lesser(f.moment * g.size, f.size * g.moment),
            (f.roundings + f.size) * g.size + f.size * g.roundings,
        )
