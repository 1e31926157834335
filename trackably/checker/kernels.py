"""Kernels, and step 2 of the proof (`checker`) for a single kernel: its enclosure over a box, an interval of time.

A kernel states its Taylor coefficients, a bound of |κ| on complex discs, and its decay, by formulas that hold for
intervals of mpmath and for arrays of float64 intervals alike.

Theorem. Consider a box with midpoint s and half width h < ρ, and let |κ(z − t_i)| ≤ M for complex |z − s| < ρ. By
Cauchy's estimate, the error of the first n terms of the Taylor series of κ(t − t_i) about t = s is at most
M (h/ρ)ⁿ/(1 − h/ρ) in the box.

Kinks. A kernel may have kinks, at a difference of 0 and where its support ends; between them it is analytic. The branch
κ₊ that holds in the middle of the box is continued over all of the box. At most two errors are added. If a kink at 0 is
in the box, the error at distance r beyond it is |κ₊(r) − κ₊(−r)|, as κ is even: twice the odd powers of the Taylor
series of κ₊ about 0, which are bounded in the same way. If other kinks are in the box, the error beyond them is
|κ(r) − κ₊(r)| for r > 0 (`jump`). At −r, the sum of both errors bounds the error, as κ is even. A box that contains 0
is refused if κ has another branch at 0 than in the middle of the box.

Far centres. Centres at distances ≥ d from all times of a box are not expanded: together they add at most Σ |c_i| K,
where K bounds |κ| at all distances ≥ d (`reach`).

Matérn kernels κ(r) = θ₁² P(x) e^(−x) with x = λ r, r ≥ 0. A sum over centres before t has the form of a single kernel.
Let a be a time with t_i ≤ a ≤ t for all i, u = t − a and v_i = λ (a − t_i). By Taylor's formula, P(λu + v) = Σ_k
P⁽ᵏ⁾(λu) vᵏ/k!, which ends with the degree of P. So Σ_i c_i κ(t − t_i) = θ₁² e^(−λu) Σ_k m_k P⁽ᵏ⁾(λu), with the moments
m_k = Σ_i c_i v_iᵏ/k! e^(−v_i). For a single kernel, a = t_i, and the moments are 1, 0, …
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cached_property, lru_cache
from itertools import zip_longest
from operator import add
from typing import Any, ClassVar, NamedTuple

from trackably.checker.intervals import (
    INFINITE,
    ONE,
    SIGN,
    ZERO,
    Real,
    between,
    cos,
    either,
    everywhere,
    exactly,
    exp,
    lesser,
    log,
    max_of,
    pi,
    root,
    select,
    sin,
    sqrt,
    surely_at_most,
    total,
)
from trackably.checker.models import Model, exp_series, power_series, times
from trackably.checker.watch import tick


class Decay(NamedTuple):
    """Over-estimates of the absolute value of a function (`size`) and of its derivative (`slope`).

    For a kernel, they hold beyond some distance; for a signal minus its mean, after some time.
    """

    size: Real
    slope: Real


class Sizes(NamedTuple):
    """Over-estimates of |κ| (`size`), |κ̇| (`slope`), |r κ̇| (`stretch`) and |r κ| (`moment`) up to some |r|.

    `roundings` over-estimates the rounding error of κ's own formula, in units of the unit roundoff u.
    """

    size: Real
    slope: Real
    stretch: Real
    moment: Real
    roundings: Real


class Kernel(ABC):
    """A stationary kernel κ(r), even in r.

    Between two kinks, κ is given by one formula, a branch, which is continued beyond the kinks. If κ has a kink at 0,
    its branches are those for r ≥ 0.
    """

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        """Return n Taylor coefficients in x of κ(r + h x), for the branch (formula) of κ that holds at r.

        Kernels that are not `exponential` have a formula of their own.
        """
        found = self.exponential(r, h, n)
        assert found is not None, "such a kernel has its own formula"
        return exp_series(*found, n)

    @abstractmethod
    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        """Over-estimate |κ(z)| for complex |z − r| < radius, on the branch at r; ∞ if it may be singular there."""

    @abstractmethod
    def beyond(self, distance: Real) -> Decay:
        """Over-estimate |κ(r)| and |κ̇(r)| for all |r| ≥ distance ≥ 0."""

    @cached_property
    def peak(self) -> Decay:
        """Over-estimates of |κ| and |κ̇| at all distances."""
        return self.beyond(ZERO)

    @abstractmethod
    def sizes(self, farthest: Real) -> Sizes:
        """Over-estimate the sizes on which the error of float64 evaluation depends, for |r| ≤ farthest [s]."""

    @property
    @abstractmethod
    def numbers(self) -> tuple[float, ...]:
        """All hyperparameters; they are positive."""

    @property
    def has_kink(self) -> bool:
        """Whether κ is not analytic at r = 0."""
        return False

    @property
    def repeats_after(self) -> float | None:
        """The period [s] that all elementary kernels in κ share; None if they share none."""
        return None

    def jump(self, r: Real, h: Real) -> Real:
        """Over-estimate |κ − κ₊| for distances from |r| − h to |r| + h, where κ₊ is the branch that holds at |r|.

        It is zero for kernels with one branch for all positive distances.
        """
        return ZERO

    def value(self, r: Real) -> Real:
        """Return an interval that contains κ(r), for the interval r."""
        return self.taylor(abs(r), ZERO, 1)[0] + SIGN * self.jump(r, ZERO)

    def exponential(self, r: Real, h: Real, n: int) -> tuple[Real, list[Real]] | None:
        """Return a, and the coefficients in x of g, for κ(r + h x) = a e^g(x); None if κ has no such form.

        Only the first n coefficients are used; those that are left out are zero.
        """
        return None

    def model(self, r: Real, h: Real, radius: Real, n: int, sides: tuple[Any, Any] | None = None) -> Model:
        """Enclose κ(r + h x) for all x ∈ [−1, 1], where h > 0.

        By Cauchy's estimate, the remainder of n terms of the Taylor series is at most M (h/ρ)ⁿ/(1 − h/ρ), where |κ| ≤ M
        on the disc of radius ρ. If the box contains a kink, the branch of its middle is continued to the other side.
        `sides` say whether the differences r + h x are certainly all ≤ 0, and whether they are certainly all ≥ 0; they
        are found from r and h if they are not given.
        """
        missed = ZERO
        if self.has_kink:
            before, after = sides or (surely_at_most(h, -r), surely_at_most(h, r))
            # κ is even: differences are mirrored to the positive side
            is_positive = either(after, surely_at_most(ZERO, r))
            r, h = select(is_positive, r, -r), select(is_positive, h, -h)
            if not everywhere(one_side := either(before, after)):
                missed = select(one_side, ZERO, self._beyond_kink(r, abs(h), radius, n))
        missed += self.largest_on_disc(r, radius) * geometric_rest(abs(h) / radius, n) + self.jump(r, abs(h))
        return Model(self.taylor(r, h, n), missed)

    def _beyond_kink(self, r: Real, half: Real, radius: Real, n: int) -> Real:
        """Over-estimate |κ − branch at r| on the other side of a kink at 0, for differences within `half` of r."""
        # If r is the kink itself, r ≥ 0 may not be certain. r ≥ −0.01 half suffices, as `oddness` covers 1.01 half.
        error = select(surely_at_most(-0.01 * half, r), self.oddness(half, radius, n), INFINITE)
        # `oddness` bounds the odd powers of the branch at 0, which must be the branch at the middle of the box
        return select(surely_at_most(self.jump(ZERO, abs(r)), ZERO), error, INFINITE)

    def oddness(self, half: Real, radius: Real, n: int) -> Real:
        """Over-estimate |κ₊(r) − κ₊(−r)| for 0 ≤ r ≤ 1.01 half, where κ₊ is the branch for small positive r."""
        reach = 1.01 * half
        odd = total(abs(coefficient) for coefficient in self.taylor(ZERO, reach, n)[1::2])
        return 2 * (odd + self.largest_on_disc(ZERO, radius) * geometric_rest(reach / radius, n))


def geometric_rest(ratio: Real, n: int) -> Real:
    """Over-estimate Σ_(k ≥ n) ratio^k."""
    return select(ratio.b < 1, ratio**n / (1 - ratio), INFINITE)


@dataclass(frozen=True)
class Elementary(Kernel):
    """κ(r) = θ₁² φ(r/θ₂, …) with `signal_std` θ₁ and `lengthscale` θ₂ [s]; every field is a positive number."""

    signal_std: float
    lengthscale: float

    decays: ClassVar[bool] = True
    """Whether |r κ̇| ≤ κ(0) at all distances."""

    largest_moment: ClassVar[float | None] = None
    """An upper bound of |r κ|/(θ₂ κ(0)); None if it is unbounded or not used."""

    steepest: ClassVar[Real]
    """The |r|/θ₂ at which |κ̇| is largest. κ must fall with |r|, and |κ̇| must rise up to this point and then fall."""

    @property
    def roundings(self) -> Real | int:
        """An over-estimate of the rounding error of κ's own formula, in units of κ(0) times the unit roundoff."""
        return 30

    @property
    def numbers(self) -> tuple[float, ...]:
        return astuple(self)

    @cached_property
    def variance(self) -> Real:
        """θ₁², the variance κ(0), as an interval."""
        return exactly(self.signal_std) ** 2

    @cached_property
    def length(self) -> Real:
        """The lengthscale θ₂ [s], as an interval."""
        return exactly(self.lengthscale)

    def scaled(self, shape: list[Real]) -> list[Real]:
        """Return the coefficients of θ₁² φ from those of φ."""
        return [self.variance * coefficient for coefficient in shape]

    def sizes(self, farthest: Real) -> Sizes:
        size, slope = self.peak
        stretch = size if self.decays else farthest * slope
        moment = farthest * size if self.largest_moment is None else size * self.length * self.largest_moment
        return Sizes(size, slope, stretch, moment, self.roundings * size)

    def beyond(self, distance: Real) -> Decay:
        value, steepest = self.taylor(distance, ZERO, 1)[0], max_of(distance, self.length * self.steepest)
        return Decay(abs(value), abs(self.taylor(steepest, ONE, 2)[1]))


@dataclass(frozen=True)
class SquaredExponential(Elementary):
    """κ(r) = θ₁² exp(−r²/(2 θ₂²)); |κ̇| is largest at r = θ₂."""

    steepest = ONE
    largest_moment = 0.607  # x e^(−x²/2) ≤ 0.607 with x = r/θ₂; and |r κ̇|/κ(0) is x² e^(−x²/2) ≤ 1

    @cached_property
    def p(self) -> Real:
        """2 θ₂² [s²], as an interval."""
        return 2 * self.length**2

    def exponential(self, r: Real, h: Real, n: int) -> tuple[Real, list[Real]]:
        g = [-(r**2) / self.p]
        return self.variance, g if n == 1 else [*g, -2 * r * h / self.p, -(h**2) / self.p]

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        # |Im z| ≤ radius on the disc, and so Re z² ≥ r²/2 − radius².
        square = (r**2 / 2 - radius**2) / self.length**2
        return self.variance * exp(-square / 2)


@dataclass(frozen=True)
class Matern(Elementary):
    """κ(r) = θ₁² P(x) e^(−x) with x = λ |r| and P(x) = Σ_j `p`[j] xʲ/`p`[0], all `p`[j] > 0; `square` is (λ θ₂)²."""

    has_kink = True
    p: ClassVar[tuple[int, ...]]
    square: ClassVar[int]

    @cached_property
    def rate(self) -> Real:
        """λ [1/s] in κ(r) = θ₁² P(λ|r|) exp(−λ|r|), as an interval that contains it."""
        return root(self.square) / self.length

    def slopes(self, x: Real) -> list[Real]:
        """Return P(x), P'(x), … up to the last nonzero derivative."""
        derivative, found = list(self.p), list[Real]()
        while derivative:
            value = ONE * derivative[-1]
            for c in derivative[-2::-1]:
                value = value * x + c
            found.append(value / self.p[0])
            derivative = [j * c for j, c in enumerate(derivative)][1:]
        return found

    def along(self, moments: Sequence[Real], x: Real, y: Real, n: int) -> list[Real]:
        """Return n coefficients in ξ of θ₁² e^(−z) Σ_k m_k P⁽ᵏ⁾(z), where z = x + y ξ and m_k = moments[k]."""
        slopes, power = self.slopes(x), ONE
        found: list[Real] = []
        for j in range(len(slopes)):
            found.append(total(m * slope for m, slope in zip(moments, slopes[j:], strict=False)) * power)
            power = y * power / (j + 1)
        return times(found, exp_series(self.variance, [-x, -y], n), n)

    def largest_around(self, moments: Sequence[Real], x: Real, y: Real) -> Real:
        """Over-estimate |θ₁² e^(−z) Σ_k m_k P⁽ᵏ⁾(z)| for complex |z − x| < y, by |P⁽ᵏ⁾(z)| ≤ P⁽ᵏ⁾(|z|).

        `moments` are the m_k of absolute weights |c_i|.
        """
        shape = total(m * slope for m, slope in zip(moments, self.slopes(x + y), strict=False))
        return self.variance * shape * exp(y - x)

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        return self.along([ONE], self.rate * r, self.rate * h, n)

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        return self.largest_around([ONE], self.rate * abs(r), self.rate * radius)


@dataclass(frozen=True)
class Matern32(Matern):
    """P(x) = 1 + x with x = √3 r/θ₂; |κ̇| is largest at r = θ₂/√3."""

    p, square = (1, 1), 3
    steepest = ONE / root(3)
    largest_moment = 0.841 / 1.732  # x (1 + x) e^(−x) ≤ 0.841; and |r κ̇|/κ(0) is x² e^(−x) ≤ 1


@dataclass(frozen=True)
class Matern52(Matern):
    """P(x) = 1 + x + x²/3 with x = √5 r/θ₂; |κ̇| is largest at r = θ₂ (1 + √5)/(2 √5)."""

    p, square = (3, 3, 1), 5
    steepest = (1 + root(5)) / (2 * root(5))
    largest_moment = 1.176 / 2.236  # x (1 + x + x²/3) e^(−x) ≤ 1.176; and |r κ̇|/κ(0) is x² (1 + x) e^(−x)/3 ≤ 1


@dataclass(frozen=True)
class Matern72(Matern):
    """P(x) = 1 + x + 2x²/5 + x³/15 in κ(r) = θ₁² P(x) e^(−x), with x = √7 r/θ₂.

    |κ̇| is largest where x³ = 3x + 3, at x = w + 1/w with w³ = (3 + √5)/2.
    """

    p, square = (15, 15, 6, 1), 7
    w = exp(log((3 + root(5)) / 2) / 3)
    steepest = (w + 1 / w) / root(7)
    # x (1 + x + 2x²/5 + x³/15) e^(−x) ≤ 1.446; and |r κ̇|/κ(0) is x² (3 + 3x + x²) e^(−x)/15 ≤ 1
    largest_moment = 1.446 / 2.645


@dataclass(frozen=True)
class RationalQuadratic(Elementary):
    """κ(r) = θ₁² (1 + r²/(2 α θ₂²))^(−α) with `shape` α; |κ̇| is largest at r = θ₂ √(2α/(2α + 1))."""

    # `decays` is true: with q = 1 + r²/(2 α θ₂²), |r κ̇| = θ₁² 2α (q − 1) q^(−α − 1) is largest at q = 1 + 1/α, where it
    # is at most 2 θ₁²/e.
    shape: float

    @cached_property
    def alpha(self) -> Real:
        """The shape α, as an interval."""
        return exactly(self.shape)

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        p = 2 * self.alpha * self.length**2
        return self.scaled(power_series([1 + r**2 / p, 2 * r * h / p, h**2 / p], -self.alpha, n))

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        # Re z² ≥ r²/2 − radius² on the disc, and so |1 + z²/(2 α θ₂²)| ≥ q.
        square = (r**2 / 2 - radius**2) / self.length**2
        q = 1 + square / (2 * self.alpha)
        is_regular = q.a > 0
        return select(is_regular, self.variance * exp(-self.alpha * log(select(is_regular, q, ONE))), INFINITE)

    @cached_property
    def steepest(self) -> Real:  # type: ignore[override]
        return sqrt(2 * self.alpha / (2 * self.alpha + 1))

    @property
    def roundings(self) -> Real:
        return 30 + 6 * self.alpha


@dataclass(frozen=True)
class Periodic(Elementary):
    """κ(r) = θ₁² exp((cos ωr − 1)/θ₂²) with ω = 2π/θ₃ and `period` θ₃; it never decays."""

    decays = False
    period: float

    @cached_property
    def omega(self) -> Real:
        """The angular frequency ω [1/s], as an interval."""
        return 2 * pi() / exactly(self.period)

    def exponential(self, r: Real, h: Real, n: int) -> tuple[Real, list[Real]]:
        cosine, sine = cos(self.omega * r), sin(self.omega * r)
        turn, step, scale = (cosine, -sine, -cosine, sine), self.omega * h, [1 / self.length**2]
        for k in range(1, n):
            scale.append(scale[-1] * step / k)
        g = [turn[k % 4] * scale[k] for k in range(n)]
        return self.variance, [g[0] - scale[0], *g[1:]]

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        # Re cos(x + iy) = cos x cosh y
        cosine, reach = cos(self.omega * (r + radius * SIGN)).b, self.omega * radius
        largest = select(cosine <= 0, cosine, cosine * (exp(reach) + exp(-reach)) / 2)
        return self.variance * exp((largest - 1) / self.length**2)

    def beyond(self, distance: Real) -> Decay:
        # |κ̇| = θ₁² ω |sin v| e^((cos v − 1)/θ₂²)/θ₂² with v = ωr, which is at most θ₁² ω e^(−1/2)/θ₂
        return Decay(self.variance, self.variance * self.omega * exp(exactly(-0.5)) / self.length)

    @property
    def repeats_after(self) -> float:
        return self.period


@dataclass(frozen=True)
class PiecewisePolynomial(Elementary):
    """κ(r) = θ₁² P(1 − |r|/θ₂) for |r| ≤ θ₂, and 0 for larger |r|, with P(y) = Σ_j `p`[j] yʲ.

    P increases from 0 to 1 on 0 ≤ y ≤ 1, and |P| increases with |y| for y ≤ 0.
    """

    largest_moment = 0.165  # s φ ≤ 0.165 with s = |r|/θ₂; and |r κ̇|/κ(0) is s |φ'| ≤ 0.756
    has_kink = True
    roundings = 35  # in up to 7 factors 1 − s, the other factor of P by Horner's rule, and θ₁²
    p: ClassVar[tuple[int, ...]]

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        y = [1 - r / self.length, -h / self.length]
        found: list[Real] = []
        for coefficient in reversed(self.p):  # Horner's rule; the degree grows by one in each step
            found = times(found, y, min(len(found) + 1, n))
            found[0] += coefficient
        is_over = self._is_over(r)
        return [*(select(is_over, ZERO, c) for c in self.scaled(found)), *[ZERO] * (n - len(found))]

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        # a polynomial is at most the sum of the absolute values of its Taylor terms, and these are all of them
        return total(abs(c) for c in self.taylor(abs(r), radius, len(self.p)))

    def jump(self, r: Real, h: Real) -> Real:
        beyond, farthest = abs(r) - h, abs(r) + h
        nearest = (beyond + abs(beyond)) / 2  # max(beyond, 0)
        from_zero = select(self.length <= nearest.a, ZERO, abs(self.taylor(nearest, ZERO, 1)[0]))
        y = 1 - farthest / self.length
        from_polynomial = self.variance * abs(total(c * y**j for j, c in enumerate(self.p) if c))
        return select(self._is_over(r), from_zero, select(farthest.b <= self.length, ZERO, from_polynomial))

    def _is_over(self, r: Real) -> bool | None:
        """Return whether |r| > θ₂ is certain, where κ is zero; otherwise the polynomial is taken as the branch at r."""
        return abs(r).a > self.length


class PiecewisePolynomial2(PiecewisePolynomial):
    """P(y) = 14 y⁵ − 21 y⁶ + 8 y⁷, that is (1 − s)⁵ (8 s² + 5 s + 1) with s = 1 − y = |r|/θ₂.

    On [0, 1], P' is largest at y = (45 − √105)/48, as P'' = 14 y³ (24 y² − 45 y + 20).
    """

    p = (0, 0, 0, 0, 0, 14, -21, 8)
    steepest = ONE - (45 - root(105)) / 48


class PiecewisePolynomial3(PiecewisePolynomial):
    """P(y) = 48 y⁷ − 108 y⁸ + 82 y⁹ − 21 y¹⁰, that is (1 − s)⁷ (21 s³ + 19 s² + 7 s + 1) with s = 1 − y = |r|/θ₂.

    P'' = 18 y⁵ (112 − 336 y + 328 y² − 105 y³). P' is largest at the last factor's only root, y = 0.760016….
    """

    p = (0, 0, 0, 0, 0, 0, 0, 48, -108, 82, -21)
    steepest = between(exactly(0.2399834902935789), exactly(0.239983490293579))


@dataclass(frozen=True)
class Combination(Kernel):
    """A kernel that is made of two kernels, `left` and `right`."""

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
        return Decay(*map(add, self.left.beyond(distance), self.right.beyond(distance)))

    def sizes(self, farthest: Real) -> Sizes:
        f, g = self.left.sizes(farthest), self.right.sizes(farthest)
        both = Sizes(*map(add, f, g))
        return both._replace(roundings=both.roundings + f.size + g.size)


class Product(Combination):
    """κ = κ₁ κ₂."""

    def exponential(self, r: Real, h: Real, n: int) -> tuple[Real, list[Real]] | None:
        f, g = self.left.exponential(r, h, n), self.right.exponential(r, h, n)
        return (f[0] * g[0], [x + y for x, y in zip_longest(f[1], g[1], fillvalue=ZERO)]) if f and g else None

    def taylor(self, r: Real, h: Real, n: int) -> list[Real]:
        if both := self.exponential(r, h, n):
            return exp_series(*both, n)
        return times(self.left.taylor(r, h, n), self.right.taylor(r, h, n), n)

    def largest_on_disc(self, r: Real, radius: Real) -> Real:
        return self.left.largest_on_disc(r, radius) * self.right.largest_on_disc(r, radius)

    def jump(self, r: Real, h: Real) -> Real:
        if not self.has_kink:
            return ZERO
        # κ₁ κ₂ − b₁ b₂ = (κ₁ − b₁) κ₂ + b₁ (κ₂ − b₂), where b_i is the branch of κ_i that holds at |r|
        f, g = self.left.jump(r, h), self.right.jump(r, h)
        of_left = select(f.b <= 0, ZERO, f * self.right.peak.size)
        return of_left + select(g.b <= 0, ZERO, self.left.largest_on_disc(r, h) * g)

    def beyond(self, distance: Real) -> Decay:
        f, g = self.left.beyond(distance), self.right.beyond(distance)
        return Decay(f.size * g.size, f.slope * g.size + f.size * g.slope)

    def sizes(self, farthest: Real) -> Sizes:
        f, g = self.left.sizes(farthest), self.right.sizes(farthest)
        return Sizes(
            f.size * g.size,
            f.slope * g.size + f.size * g.slope,
            # |r κ̇₁ κ₂| is at most |r κ̇₁| |κ₂|, and at most |κ̇₁| |r κ₂|; likewise |r κ₁ κ̇₂|
            lesser(f.stretch * g.size, f.slope * g.moment) + lesser(f.size * g.stretch, f.moment * g.slope),
            lesser(f.moment * g.size, f.size * g.moment),
            (f.roundings + f.size) * g.size + f.size * g.roundings,
        )


ELEMENTARY: dict[str, type[Elementary]] = {
    "squared_exponential": SquaredExponential,
    "matern32": Matern32,
    "matern52": Matern52,
    "matern72": Matern72,
    "rational_quadratic": RationalQuadratic,
    "periodic": Periodic,
    "piecewise_polynomial2": PiecewisePolynomial2,
    "piecewise_polynomial3": PiecewisePolynomial3,
}
COMBINATIONS: dict[str, type[Combination]] = {"sum": Sum, "product": Product}


_DOUBLINGS, _HALVINGS = 10, 15


class Reach(NamedTuple):
    """A distance [s], and upper bounds of |κ| and |κ̇| at all larger distances.

    The distance is infinite if none was found at which |κ| is small enough.
    """

    distance: float
    decay: Decay


@lru_cache
def reach(kernel: Kernel, span: float, part: float) -> Reach:
    """Return a small distance beyond which |κ| ≤ `part` · κ(0), with the bounds there.

    Some multiples of `span` [s], the time from the first centre to the last, are tried. The distance is infinite if
    none of them is large enough.
    """
    most, found = kernel.peak.size * part, Reach(float("inf"), Decay(ZERO, ZERO))
    for k in (*range(-4 * _DOUBLINGS, 0, 4), *range(1, 4 * _HALVINGS)):
        tick()
        distance = span * 2.0 ** (-k / 4)
        decay = kernel.beyond(exactly(distance))
        if not decay.size.b <= most.a:
            break
        found = Reach(distance, decay)
    return found
