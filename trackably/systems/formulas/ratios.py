"""Quotients of polynomials with rational coefficients, in lowest terms."""

from dataclasses import dataclass
from fractions import Fraction
from math import isqrt

from flint import Ordering, fmpq, fmpq_mpoly, fmpq_mpoly_ctx

MOST_TERMS = 3000


class TooLongError(ArithmeticError):
    """A polynomial has more than `MOST_TERMS` terms."""


@dataclass(frozen=True)
class Ratio:
    """numerator/denominator, with no common factor."""

    numerator: fmpq_mpoly
    denominator: fmpq_mpoly

    @classmethod
    def of(cls, numerator: fmpq_mpoly, denominator: fmpq_mpoly) -> "Ratio":
        """Return the quotient in lowest terms. ZeroDivisionError: the denominator is zero."""
        if not denominator:
            raise ZeroDivisionError("a denominator is zero")
        if len(numerator) > MOST_TERMS or len(denominator) > MOST_TERMS:
            raise TooLongError("a formula has too many terms when it is multiplied out")
        if denominator.is_constant():
            return cls(numerator / denominator.leading_coefficient(), denominator / denominator.leading_coefficient())
        common = numerator.gcd(denominator)
        numerator, denominator = numerator / common, denominator / common
        leading = denominator.leading_coefficient()
        return cls(numerator / leading, denominator / leading)

    def __add__(self, other: "Ratio") -> "Ratio":
        if self.denominator == other.denominator:
            return Ratio.of(self.numerator + other.numerator, self.denominator)
        crossed = self.numerator * other.denominator + other.numerator * self.denominator
        return Ratio.of(crossed, self.denominator * other.denominator)

    def __neg__(self) -> "Ratio":
        return Ratio(-self.numerator, self.denominator)

    def __sub__(self, other: "Ratio") -> "Ratio":
        return self + -other

    def __mul__(self, other: "Ratio") -> "Ratio":
        return Ratio.of(self.numerator * other.numerator, self.denominator * other.denominator)

    def __truediv__(self, other: "Ratio") -> "Ratio":
        return Ratio.of(self.numerator * other.denominator, self.denominator * other.numerator)

    @property
    def constant(self) -> fmpq | None:
        """The number that it is; None if it is no number."""
        if not (self.numerator.is_constant() and self.denominator.is_constant()):
            return None
        return self.numerator.leading_coefficient() if self.numerator else fmpq(0)


def ring(names: list[str]) -> fmpq_mpoly_ctx:
    """Return the polynomials in variables of these names."""
    return fmpq_mpoly_ctx.get(tuple(names), Ordering.lex)


def square_root(number: fmpq) -> fmpq | None:
    """Return the rational root of a rational number; None if there is none."""
    p, q = int(number.p), int(number.q)
    if p < 0 or isqrt(p) ** 2 != p or isqrt(q) ** 2 != q:
        return None
    return fmpq(isqrt(p), isqrt(q))


def as_fmpq(value: float) -> fmpq:
    """Return a float64 as the rational number that it is."""
    exact = Fraction(value)
    return fmpq(exact.numerator, exact.denominator)
