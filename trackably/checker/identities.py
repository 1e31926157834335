"""Formulas as quotients of polynomials, which show that two formulas are equal.

The variables of the polynomials stand for names, and for atoms: values of functions such as √a or sin α. The rules are

  √a: its square is a. It is q √b for a = q² b with a number q > 0, q for a = q², q √b √c for a = q² b c, and q p for
    a = q² p² with p > 0. (√b and √c are atoms that exist already.)
  sin, cos: for a sum, they follow from those of its terms. For a single term α, sin² α = 1 − cos² α. With v = (x, y)
    and |v| = √(x² + y²), sin(atan2(y, x)) = y/|v|, cos(atan2(y, x)) = x/|v|; sin(atan w) = w/√(1 + w²), cos(atan w) =
    1/√(1 + w²).
  exp, log: exp(log a) = log(exp a) = a.

Each rule is a true equality of real numbers wherever both sides have values and |v| > 0. Every value is kept as a
quotient whose divisor is a product of divisors and roots that occur in the formula, and of |v|. So the divisor is not
zero where all parts of the formula are defined. Hence formulas with the same quotient have the same value wherever all
their parts are defined.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import chain
from math import isqrt

from trackably.checker.formulas import OPERATORS, Angle, Formula, Function, Name, Number, Operation, Power, parts
from trackably.checker.watch import short, tick

Monomial = tuple[tuple[int, int], ...]
"""Pairs (−i, p) of a variable i and its power p ≥ 1, with i ascending; tuples of them compare lexicographically."""

Polynomial = Mapping[Monomial, Fraction]
"""The coefficients that are not zero, by monomial; {} is the zero polynomial."""

_MOST_TERMS = 5000
_TOO_LONG = f"a formula has more than {_MOST_TERMS} terms when it is multiplied out"
_UNIT: Polynomial = {(): Fraction(1)}
INVERSES = {"exp": "log", "log": "exp"}
"""The function that undoes a function, by its name."""


class TooLongError(ArithmeticError):
    """A polynomial has more than 5000 terms, or there are more than 80 values of functions."""


def add(p: Polynomial, q: Polynomial) -> Polynomial:
    """Return p + q."""
    found = dict(p)
    for m, c in q.items():
        found[m] = short(found.get(m, Fraction(0)) + c)
    return {m: c for m, c in found.items() if c}


def multiply(p: Polynomial, q: Polynomial) -> Polynomial:
    """Return p q. Raise TooLongError if it has too many terms."""
    found: dict[Monomial, Fraction] = {}
    for m, c in p.items():
        for n, d in q.items():
            both = _together(m, n)
            found[both] = short(found.get(both, Fraction(0)) + c * d)
        if len(found) > _MOST_TERMS:
            raise TooLongError(_TOO_LONG)
    return {m: c for m, c in found.items() if c}


def _together(m: Monomial, n: Monomial) -> Monomial:
    both = dict(m)
    for i, power in n:
        both[i] = both.get(i, 0) + power
    return _sort(both)


def _sort(powers: Mapping[int, int]) -> Monomial:
    return tuple(sorted(((i, power) for i, power in powers.items() if power), reverse=True))


@dataclass(frozen=True)
class Quotient:
    """The rational function `above`/`below`, where `below` is not the zero polynomial."""

    above: Polynomial
    below: Polynomial

    @classmethod
    def of(cls, above: Polynomial, below: Polynomial) -> "Quotient":
        """Return above/below, without common monomials. Raise ZeroDivisionError if `below` is zero."""
        tick()
        if not below:
            raise ZeroDivisionError("a divisor in them is zero")
        common = _common([*above, *below])
        if common:
            above, below = (_without(p, common) for p in (above, below))
        leading = below[max(below)]
        return cls({m: c / leading for m, c in above.items()}, {m: c / leading for m, c in below.items()})

    @classmethod
    def number(cls, value: Fraction) -> "Quotient":
        """Return a constant as a quotient."""
        return cls({(): value} if value else {}, _UNIT)

    @classmethod
    def variable(cls, i: int) -> "Quotient":
        """Return variable i as a quotient."""
        return cls({((-i, 1),): Fraction(1)}, _UNIT)

    def __add__(self, other: "Quotient") -> "Quotient":
        if self.below == other.below:
            return Quotient.of(add(self.above, other.above), self.below)
        crossed = add(multiply(self.above, other.below), multiply(other.above, self.below))
        return Quotient.of(crossed, multiply(self.below, other.below))

    def __neg__(self) -> "Quotient":
        return Quotient({m: -c for m, c in self.above.items()}, self.below)

    def __sub__(self, other: "Quotient") -> "Quotient":
        return self + -other

    def __mul__(self, other: "Quotient") -> "Quotient":
        return Quotient.of(multiply(self.above, other.above), multiply(self.below, other.below))

    def __truediv__(self, other: "Quotient") -> "Quotient":
        return Quotient.of(multiply(self.above, other.below), multiply(self.below, other.above))

    @property
    def constant(self) -> Fraction | None:
        """The value of a constant quotient; None if it is not constant, or zero."""
        if self.above.keys() != self.below.keys():
            return None
        values = {c / self.below[m] for m, c in self.above.items()}
        return values.pop() if len(values) == 1 else None


def _common(monomials: Iterable[Monomial]) -> Monomial:
    """Return the largest monomial that divides all given monomials."""
    first, *others = (dict(m) for m in monomials)
    for m in others:
        tick()
        first = {i: least for i, power in first.items() if (least := min(power, m.get(i, 0)))}
    return tuple(first.items())


def _without(p: Polynomial, factor: Monomial) -> Polynomial:
    by = dict(factor)
    tick()
    return {_sort({i: power - by.get(i, 0) for i, power in m}): c for m, c in p.items()}


_MOST_ATOMS = 80
_MOST_MULTIPLIED = 16
_ONE, _ZERO = Quotient.number(Fraction(1)), Quotient.number(Fraction(0))


@dataclass(frozen=True)
class Atom:
    """The value of a function at some `arguments`; the variable with this `number` stands for it in polynomials.

    `square` is the quotient that takes the place of the variable's square; None if no rule gives one.
    """

    function: str
    arguments: tuple[Quotient, ...]
    number: int
    square: Quotient | None


@dataclass
class Values:
    """The values of several formulas, as quotients in common variables. Formulas in `positive` are assumed positive."""

    numbers: dict[str, int] = field(default_factory=dict)
    atoms: list[Atom] = field(default_factory=list)
    positive: list[Quotient] = field(default_factory=list)
    known: dict[Formula, Quotient] = field(default_factory=dict)

    def of(self, formula: Formula) -> Quotient:
        """Return the quotient of a formula. TooLongError: too many terms; ZeroDivisionError: a divisor is zero."""
        for node in parts(formula):
            if node not in self.known:
                self.known[node] = self._of(node)
        return self.known[formula]

    def is_zero(self, value: Quotient) -> bool:
        """Return whether a quotient is certainly zero."""
        return not self.reduce(value).above

    def direction(self, angle: Quotient) -> tuple[Quotient, Quotient]:
        """Return cosine and sine of an angle."""
        cosine, sine = _ONE, _ZERO
        for m, c in angle.above.items():
            whole = c.denominator == 1 and abs(c) <= _MOST_MULTIPLIED
            term = Quotient.of({m: Fraction(1) if whole else abs(c)}, angle.below)
            x, y = self._direction_of_term(term)
            for _ in range(abs(int(c)) if whole else 1):
                turned = y if c > 0 else -y
                cosine, sine = (
                    self.reduce(cosine * x - sine * turned),
                    self.reduce(cosine * turned + sine * x),
                )
        return cosine, sine

    def reduce(self, value: Quotient) -> Quotient:
        """Return a quotient with the square of each atom replaced by the atom's `square`.

        The last atom comes first, as it may contain earlier ones.
        """
        for atom in reversed(self.atoms):
            if atom.square is not None:
                above, below = (_without_squares(p, atom.number, atom.square) for p in (value.above, value.below))
                if above is not None or below is not None:
                    value = (above or Quotient(value.above, _ONE.below)) / (below or Quotient(value.below, _ONE.below))
        return value

    def _of(self, node: Formula) -> Quotient:
        match node:
            case Number(value):
                found = Quotient.number(Fraction(value))
            case Name(name):
                found = Quotient.variable(self.numbers.setdefault(name, self._next))
            case Operation(symbol, left, right):
                found = self.reduce(OPERATORS[symbol](self.known[left], self.known[right]))
            case Power(base, exponent):
                found = self._power(self.known[base], exponent)
            case Function("sqrt", argument):
                found = self._root(self.known[argument])
            case Function("cos" | "sin" as name, argument):
                found = self.direction(self.known[argument])[name == "sin"]
            case Function(name, argument):
                found = self._atom(name, (self.known[argument],))
            case Angle(y, x):
                self._length(self.known[x], self.known[y])  # so that this root is known before products of roots occur
                found = self._atom("atan2", (self.known[y], self.known[x]))
        return found

    @property
    def _next(self) -> int:
        """The number of the next variable."""
        return len(self.numbers) + len(self.atoms) + 1

    def _power(self, base: Quotient, exponent: float) -> Quotient:
        if not (exponent.is_integer() and abs(exponent) <= _MOST_MULTIPLIED):
            return self._atom(f"power {exponent!r}", (base,))
        found = _ONE
        for _ in range(abs(int(exponent))):
            found = self.reduce(found * base)
        return found if exponent >= 0 else _ONE / found

    def _root(self, a: Quotient) -> Quotient:
        roots = [(Quotient.variable(at.number), at.arguments[0]) for at in self.atoms if at.function == "sqrt"]
        products = ((self.reduce(x * y), self.reduce(b * c)) for i, (x, b) in enumerate(roots) for y, c in roots[i:])
        for root, square in chain(((p, p * p) for p in self.positive), [(_ONE, _ONE)], roots, products):
            if self.is_zero(a - square):
                return root
            if square.above and (q := _rational_root((a / square).constant)) is not None:
                return Quotient.number(q) * root
        return self._atom("sqrt", (a,), a)

    def _length(self, x: Quotient, y: Quotient) -> Quotient:
        return self._root(self.reduce(x * x + y * y))

    def _direction_of_term(self, term: Quotient) -> tuple[Quotient, Quotient]:
        for atom in self.atoms:
            if self.is_zero(term - Quotient.variable(atom.number)):
                if atom.function == "atan2":
                    y, x = atom.arguments
                    length = self._length(x, y)
                    return x / length, y / length
                if atom.function == "atan":
                    length = self._length(_ONE, atom.arguments[0])
                    return _ONE / length, atom.arguments[0] / length
        cosine = self._atom("cos", (term,))
        return cosine, self._atom("sin", (term,), _ONE - cosine * cosine)

    def _atom(self, function: str, arguments: tuple[Quotient, ...], square: Quotient | None = None) -> Quotient:
        for atom in self.atoms:
            if atom.function == function and all(
                self.is_zero(a - b) for a, b in zip(atom.arguments, arguments, strict=True)
            ):
                return Quotient.variable(atom.number)
            if atom.function == INVERSES.get(function) and self.is_zero(arguments[0] - Quotient.variable(atom.number)):
                return atom.arguments[0]
        if len(self.atoms) == _MOST_ATOMS:
            raise TooLongError(
                f"the formulas have more than {_MOST_ATOMS} different function terms, such as sin(x); simplify them"
            )
        self.atoms.append(atom := Atom(function, arguments, self._next, square))
        return Quotient.variable(atom.number)


def _rational_root(number: Fraction | None) -> Fraction | None:
    """Return the square root of a positive number if the root is rational; otherwise None."""
    if number is None or number <= 0:
        return None
    above, below = isqrt(number.numerator), isqrt(number.denominator)
    return Fraction(above, below) if Fraction(above, below) ** 2 == number else None


def _without_squares(p: Polynomial, i: int, square: Quotient) -> Quotient | None:
    """Replace the square of variable i in p by the quotient `square`, until p is linear in this variable.

    Return None if p is already linear in variable i.
    """
    of_squares: dict[int, dict[Monomial, Fraction]] = {}  # the coefficients of the powers of the square
    for m, c in p.items():
        tick()
        squares, power = divmod(dict(m).get(-i, 0), 2)
        of_squares.setdefault(squares, {})[_sort({**dict(m), -i: power})] = c
    if max(of_squares, default=0) < 1:
        return None
    found, factor = _ZERO, _ONE
    for squares in range(max(of_squares) + 1):
        found = found + Quotient(of_squares.get(squares, {}), _UNIT) * factor
        factor = factor * square
    return found
