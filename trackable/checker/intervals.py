"""Interval arithmetic (mpmath iv): what is certain of real numbers, whatever is rounded."""

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from mpmath.ctx_iv import MPIntervalContext

iv = MPIntervalContext()
iv.prec = 160

Real = Any
"""An interval of mpmath that holds a real number."""

ONE, ZERO, SIGN, INFINITE = iv.mpf(1), iv.mpf(0), iv.mpf([-1, 1]), iv.mpf([0, "inf"])
GUARD = SIGN * iv.mpf(2) ** -130  # mpmath rounds its functions outwards; this covers what their last bits might miss


def exp(x: Real) -> Real:
    """e^x; without a bound above e^(10⁶), and without one below e^(−10⁶): such numbers decide nothing."""
    if x.b > 1e6:
        return INFINITE
    if x.a < -1e6:
        return iv.mpf([0, exp(iv.mpf(max(x.b, iv.mpf(-1e6)))).b])
    return iv.exp(x) * (1 + GUARD)


def log(x: Real) -> Real:
    """The logarithm of positive numbers."""
    return iv.log(x) * (1 + GUARD) + GUARD


def sqrt(x: Real) -> Real:
    """The square root of positive numbers."""
    return iv.sqrt(x) * (1 + GUARD)


def cos(x: Real) -> Real:
    """The cosine."""
    return iv.cos(x) + GUARD


def sin(x: Real) -> Real:
    """The sine."""
    return iv.sin(x) + GUARD


def root(x: float) -> Real:
    """The square root of a number."""
    return sqrt(iv.mpf(x))


def at_most(x: Real, y: Real) -> bool:
    """Whether x ≤ y for certain."""
    return bool(iv.mpf(x).b <= iv.mpf(y).a)


def ratio(number: Fraction) -> Real:
    """A rational number."""
    return iv.mpf(number.numerator) / iv.mpf(number.denominator)


def exact_sum(numbers: Iterable[Fraction]) -> Fraction:
    """The sum of rational numbers."""
    return sum(numbers, Fraction(0))
