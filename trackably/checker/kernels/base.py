"""What a kernel must say of itself, and its enclosure over a box of time, written once for all kernels."""

from abc import ABC, abstractmethod
from functools import cached_property
from typing import NamedTuple

from trackably.checker.arithmetic.intervals import INFINITE, SIGN, ZERO, Real, at_most, chosen, total
from trackably.checker.arithmetic.models import Model


class Decay(NamedTuple):
    """Over-estimates of |κ| and |κ̇| from some distance on."""

    size: Real
    slope: Real


class Sizes(NamedTuple):
    """Over-estimates of |κ|, |κ̇|, |r κ̇| and |r κ|, and of the roundings in κ's own formula in units of u."""

    size: Real
    slope: Real
    stretch: Real
    moment: Real
    roundings: Real


class Kernel(ABC):
    """A stationary kernel κ(r), even in r; a kernel with a kink at 0 means its branch of positive differences."""

    @abstractmethod
    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        """Return n coefficients in x of κ(r + h x), of the branch that holds at r."""

    @abstractmethod
    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        """Over-estimate |κ(z)|, of the branch that holds at r, on |z − r| < radius; infinite if it may be singular."""

    @abstractmethod
    def beyond(self, distance: Real) -> Decay:
        """Over-estimate |κ(r)| and |κ̇(r)| for all |r| ≥ distance ≥ 0."""

    @cached_property
    def peak(self) -> Decay:
        """Over-estimates of |κ| and |κ̇|."""
        return self.beyond(ZERO)

    @abstractmethod
    def sizes(self, farthest: Real) -> Sizes:
        """Over-estimate what the error of float64 evaluation depends on, for |r| ≤ farthest."""

    @property
    @abstractmethod
    def numbers(self) -> tuple[float, ...]:
        """All hyperparameters; positive."""

    @property
    def has_kink(self) -> bool:
        """Whether κ is not analytic at r = 0."""
        return False

    @property
    def repeats_after(self) -> float | None:
        """The period [s] of every part of κ; None where they have none in common."""
        return None

    def jump(self, r: Real, h: Real) -> Real:
        """Over-estimate how far κ is from its branch at |r| between |r| − h and |r| + h, on the positive side.

        Zero for kernels with one branch for all positive differences.
        """
        return ZERO

    def value(self, r: Real) -> Real:
        """Return κ(r)."""
        return self.taylor(abs(r), ZERO, 1)[0] + SIGN * self.jump(r, ZERO)

    def model(self, r: Real, h: Real, radius: Real, n: int) -> Model:
        """Enclose κ(r + h x) for all x ∈ [−1, 1].

        By Cauchy's estimate n terms of the Taylor series miss no more than M (h/ρ)ⁿ/(1 − h/ρ), where |κ| ≤ M on the
        disc of radius ρ. Where the box contains a kink, the branch of its middle is continued to the other side.
        """
        after, before = at_most(h, r), at_most(h, -r)
        # κ is even: differences are mirrored to the positive side
        side = 1 if after or (not before and at_most(0, r)) else -1
        missed = self.largest_on_disc(r, radius) * geometric_rest(h / radius, n) + self.jump(r, h)
        if self.has_kink and not (before or after):
            # r ≥ 0 is not certain right on the kink: then 1.01 h must still reach to the end of the box
            reached = at_most(-0.01 * h, side * r)
            # the branch of the box's middle must be that of the kink: its odd powers are bounded
            same_branch = at_most(self.jump(ZERO, abs(r)), ZERO)
            missed += self.oddness(1.01 * h, radius, n) if reached and same_branch else INFINITE
        return Model(self.taylor(side * r, side * h, n), missed)

    def oddness(self, reach: Real, radius: Real, n: int) -> Real:
        """Over-estimate |κ₊(r) − κ₊(−r)| for 0 ≤ r ≤ reach, where κ₊ is the branch of positive differences."""
        odd = total(abs(coefficient) for coefficient in self.taylor(ZERO, reach, n)[1::2])
        return 2 * (odd + self.largest_on_disc(ZERO, radius) * geometric_rest(reach / radius, n))


def geometric_rest(ratio: Real, n: int) -> Real:
    """Over-estimate Σ_(k ≥ n) ratio^k."""
    return chosen(ratio.b < 1, ratio**n / (1 - ratio), INFINITE)
