"""What a proof must know of a kernel, and its Taylor polynomials with their remainders, written once for all kernels.

Hyperparameters are the stored float64 numbers, taken as exact reals; π is a ball. All bounds over-estimate. Distances
and radii are in seconds.

`taylor`, `on_disc`, `far`, `beyond` and `jump` are written once for two arithmetics: for arb and arb_series, and for
arrays of float64 balls and of series of them (`floats`). So they compare numbers by `choose` only.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, NamedTuple

from flint import arb, arb_series

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.floats.choice import Number, PowerSeries, from_point, zero

BEYOND_HALF = 1.01


class Decay(NamedTuple, Generic[Number]):
    """Bounds of |κ| and |κ̇| from some distance on."""

    size: Number
    slope: Number


class Sensitivity(NamedTuple):
    """Bounds of |κ|, |κ̇|, |r κ̇| and |r κ| within some distance, and of the formula's own roundings in u."""

    size: arb
    slope: arb
    stretch: arb
    moment: arb
    formula: arb


@dataclass(frozen=True)
class Expansion:
    """Taylor polynomials of so many `terms` in a box of half width `half`, with discs of this `radius` [s]."""

    half: arb
    radius: arb
    terms: int

    @cached_property
    def rest(self) -> arb:
        """Σ_(k ≥ terms) (half/radius)ᵏ."""
        return geometric_rest(self.half / self.radius, self.terms)


class KernelBalls(ABC):
    """A kernel κ(r) in ball arithmetic. A kernel with a kink at 0 means its branch of positive differences."""

    @abstractmethod
    def taylor(self, r: PowerSeries) -> PowerSeries:
        """Enclose κ along r = r₀ + h x + …, as a power series in x; the branch that holds at r₀ > 0."""

    def exponential(self, r: PowerSeries) -> tuple[arb, PowerSeries] | None:
        """Return v and e with κ = v exp(e) along r, as `taylor` does; None where κ is not stated so."""
        return None

    @abstractmethod
    def on_disc(self, r: Number, radius: Number) -> Number:
        """Bound |κ(z)| over |z − r| ≤ radius, of the branch that holds at |r|; infinite where κ is singular."""

    @abstractmethod
    def far(self, distance: Number, radius: Number) -> Number:
        """Bound |κ(z)| over |z − r| ≤ radius for all |r| ≥ distance ≥ radius, of every branch; it may be infinite."""

    @abstractmethod
    def beyond(self, distance: Number) -> Decay[Number]:
        """Bound |κ(r)| and |κ̇(r)| over all |r| ≥ distance ≥ 0."""

    @cached_property
    def largest(self) -> Decay[arb]:
        """Bounds of |κ(r)| and |κ̇(r)| over all r."""
        with ball_arithmetic(2):
            return self.beyond(arb(0))

    @abstractmethod
    def sensitivity(self, reach: arb) -> Sensitivity:
        """Bound what the error of float64 evaluation depends on, for |r| ≤ reach."""

    @property
    def is_analytic(self) -> bool:
        """Whether κ is analytic at r = 0."""
        return not self.kinks

    @property
    def kinks(self) -> tuple[float, ...]:
        """The distances |r| [s] at which κ changes its branch; none where it is analytic."""
        return ()

    @property
    def has_one_branch(self) -> bool:
        """Whether one branch holds for all positive differences."""
        return len(self.kinks) < 2

    @property
    def has_periodic_part(self) -> bool:
        """Whether any part of κ repeats for ever."""
        return False

    def jump(self, r: Number, half: Number) -> Number:
        """Bound how far κ is from its branch at |r| between |r| − half and |r| + half, on the positive side.

        Zero for kernels with one branch for all positive differences.
        """
        return zero(r)

    def value(self, r: Number) -> Number:
        """Enclose κ(r)."""
        found: Number = self.taylor(from_point(abs(r), 1))[0]
        return found if self.has_one_branch else found + arb(0, 1) * self.jump(r, zero(r))

    def polynomial(self, r: arb, box: Expansion, side: int) -> arb_series:
        """Return the Taylor polynomial of κ(r + half x) in x; `side` as in `missed`."""
        # κ is even: differences are mirrored to the branch of r ≥ 0.
        mirror = side or (1 if r >= 0 else -1)
        return self.taylor(arb_series([mirror * r, mirror * box.half], prec=box.terms))

    def missed(self, r: arb, box: Expansion, side: int) -> arb:
        """Bound what the Taylor polynomial about r leaves out in the box.

        `side` is the sign of all differences in the box, and 0 where they have both signs. By Cauchy's estimate with
        |κ| ≤ M on |z − r| < ρ: Σ_(k ≥ terms) |κ⁽ᵏ⁾(r)| hᵏ/k! ≤ M (h/ρ)^terms / (1 − h/ρ). If the box contains the kink
        of a kernel, the branch of the box's middle is continued beyond it.
        """
        found = self.on_disc(r, box.radius) * box.rest + self.jump(r, box.half)
        if not (self.is_analytic or side):
            # A middle of uncertain sign is next to the kink, or else nothing is known.
            known = r > 0 or r < 0 or abs(r) < box.half / 1000
            # The branch of the box's middle is continued, and its odd powers are those of the branch at the kink.
            same_branch = self.jump(arb(0), abs(r)).is_zero()
            found += self._oddness(box) if known and same_branch else arb.pos_inf()
        return found

    def _oddness(self, box: Expansion) -> arb:
        """Bound |κ₊(r) − κ₊(−r)| in the box around the kink: what continuing the branch κ₊ of r ≥ 0 beyond it costs.

        Of (1 + x) e^(−x) the odd powers begin with x³, of Matérn 5/2 with x⁵.
        """
        reach = box.half * BEYOND_HALF
        rest = self.on_disc(arb(0), box.radius) * geometric_rest(reach / box.radius, box.terms)
        with ball_arithmetic(box.terms):
            odd = self.taylor(arb_series([0, reach], prec=box.terms)).coeffs()[1::2]
            return 2 * (sum((abs(coefficient) for coefficient in odd), arb(0)) + rest)


def geometric_rest(ratio: arb, terms: int) -> arb:
    """Return Σ_(k ≥ terms) ratioᵏ."""
    return ratio**terms / (1 - ratio) if ratio < 1 else arb.pos_inf()
