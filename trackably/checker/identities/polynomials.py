"""Polynomials with rational coefficients, and their quotients."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from trackably.checker.watch import short, tick

Monomial = tuple[tuple[int, int], ...]
"""Pairs (−i, p) of variables i with their powers p ≥ 1, i ascending: tuples then compare in lexicographic order."""

Polynomial = Mapping[Monomial, Fraction]
"""Coefficients other than zero; {} is zero."""

_MOST_TERMS = 5000
_TOO_LONG = f"a formula has more than {_MOST_TERMS} terms when it is multiplied out"
_UNIT: Polynomial = {(): Fraction(1)}


class TooLongError(ArithmeticError):
    """A polynomial has more than 5000 terms."""


def added(p: Polynomial, q: Polynomial, factor: int = 1) -> Polynomial:
    """Return p + factor q."""
    found = dict(p)
    for m, c in q.items():
        found[m] = short(found.get(m, Fraction(0)) + factor * c)
    return {m: c for m, c in found.items() if c}


def multiplied(p: Polynomial, q: Polynomial) -> Polynomial:
    """Return p q. Raise TooLongError where it is long."""
    found: dict[Monomial, Fraction] = {}
    for m, c in p.items():
        for n, d in q.items():
            both = _together(m, n)
            found[both] = short(found.get(both, Fraction(0)) + c * d)
        if len(found) > _MOST_TERMS:
            raise TooLongError(_TOO_LONG)
    return {m: c for m, c in found.items() if c}


def quotient(p: Polynomial, q: Polynomial) -> Polynomial | None:
    """Return p/q where it is a polynomial; None where it is not."""
    rest, found, highest = p, dict[Monomial, Fraction](), max(q)
    while rest:
        m = max(rest)
        left = dict(m)
        for i, power in highest:
            left[i] = left.get(i, 0) - power
        if min(left.values(), default=0) < 0:
            return None
        if len(found) == _MOST_TERMS:
            raise TooLongError(_TOO_LONG)
        term = _sorted(left)
        found[term] = rest[m] / q[highest]
        rest = added(rest, multiplied({term: found[term]}, q), -1)
    return found


def powers_of(i: int, p: Polynomial) -> dict[int, Polynomial]:
    """Return the coefficients of the powers of variable i, which are polynomials in the others."""
    found: dict[int, dict[Monomial, Fraction]] = {}
    for m, c in p.items():
        tick()
        others = tuple((j, power) for j, power in m if j != -i)
        found.setdefault(dict(m).get(-i, 0), {})[others] = c
    return dict(found)


def _together(m: Monomial, n: Monomial) -> Monomial:
    both = dict(m)
    for i, power in n:
        both[i] = both.get(i, 0) + power
    return _sorted(both)


def _sorted(powers: Mapping[int, int]) -> Monomial:
    return tuple(sorted(((i, power) for i, power in powers.items() if power), reverse=True))


@dataclass(frozen=True)
class Quotient:
    """`above`/`below`; below is not the zero polynomial."""

    above: Polynomial
    below: Polynomial

    @classmethod
    def of(cls, above: Polynomial, below: Polynomial) -> "Quotient":
        """Return the quotient, simplified where that is easy. Raise ZeroDivisionError where it divides by zero."""
        tick()
        if not below:
            raise ZeroDivisionError("it divides by zero")
        common = _common([*above, *below])
        if common:
            above, below = (_without(p, common) for p in (above, below))
        if len(below) > 1:
            whole = quotient(above, below)
            above, below = (above, below) if whole is None else (whole, _UNIT)
        leading = below[max(below)]
        return cls({m: c / leading for m, c in above.items()}, {m: c / leading for m, c in below.items()})

    @classmethod
    def number(cls, value: Fraction) -> "Quotient":
        """Return a number."""
        return cls({(): value} if value else {}, _UNIT)

    @classmethod
    def variable(cls, i: int) -> "Quotient":
        """Return variable i."""
        return cls({((-i, 1),): Fraction(1)}, _UNIT)

    def __add__(self, other: "Quotient") -> "Quotient":
        if self.below == other.below:
            return Quotient.of(added(self.above, other.above), self.below)
        crossed = added(multiplied(self.above, other.below), multiplied(other.above, self.below))
        return Quotient.of(crossed, multiplied(self.below, other.below))

    def __neg__(self) -> "Quotient":
        return Quotient({m: -c for m, c in self.above.items()}, self.below)

    def __sub__(self, other: "Quotient") -> "Quotient":
        return self + -other

    def __mul__(self, other: "Quotient") -> "Quotient":
        return Quotient.of(multiplied(self.above, other.above), multiplied(self.below, other.below))

    def __truediv__(self, other: "Quotient") -> "Quotient":
        return Quotient.of(multiplied(self.above, other.below), multiplied(self.below, other.above))

    @property
    def constant(self) -> Fraction | None:
        """The number that it is; None where it is none."""
        if set(self.above) <= {()} and set(self.below) == {()}:
            return self.above.get((), Fraction(0)) / self.below[()]
        return None


def _common(monomials: Iterable[Monomial]) -> Monomial:
    """Return the largest monomial that divides all of these."""
    first, *others = (dict(m) for m in monomials)
    for m in others:
        tick()
        first = {i: least for i, power in first.items() if (least := min(power, m.get(i, 0)))}
    return tuple(first.items())


def _without(p: Polynomial, factor: Monomial) -> Polynomial:
    by = dict(factor)
    tick()
    return {_sorted({i: power - by.get(i, 0) for i, power in m}): c for m, c in p.items()}
