"""Normal forms, by which formulas are shown to be equal: quotients of polynomials in variables and roots, sines, ….

Each value of a function that is no polynomial is a new variable, an atom, with what is known about it:

- √a has the square a; it is q √b · √c if a = q² b c for known roots and a number q, q √b if a = q² b, q if a = q², and
  p if a = p² for a formula p that is known to be positive;
- sin² a is 1 − cos² a; sines and cosines of sums of terms are those of the terms; with v = (x, y), sin(atan2(y, x)) is
  y/|v| and cos(atan2(y, x)) is x/|v|, where |v| = √(x² + y²); sin(atan w) is w/√(1 + w²) and cos(atan w) 1/√(1 + w²).

Formulas with equal normal forms are equal wherever all their parts are defined, v ≠ 0, and `positive` formulas are
positive. Formulas with different normal forms may be equal all the same.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

from flint import fmpq, fmpq_mpoly

from trackably.systems.formulas.expression import (
    Angle,
    Binary,
    Constant,
    Difference,
    Expression,
    Function,
    Power,
    Product,
    Sum,
    Variable,
    all_nodes,
    operands,
)
from trackably.systems.formulas.ratios import Ratio, TooLongError, as_fmpq, ring, square_root

_MOST_ATOMS = 60
_MOST_MULTIPLIED = 16


@dataclass(frozen=True)
class _Atom:
    """A value of a function: its `square`, if there is a rule for it."""

    function: str
    arguments: tuple[Ratio, ...]
    value: Ratio
    square: Ratio | None


@dataclass
class NormalForms:
    """Normal forms of formulas of these variables; formulas in `positive` are positive."""

    variables: Iterable[str]
    positive: Iterable[Expression] = ()
    _atoms: list[_Atom] = field(default_factory=list)
    _known: dict[int, tuple[Expression, Ratio]] = field(default_factory=dict)
    _roots: list[Ratio] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._names = sorted(self.variables)
        self._ring = ring([*self._names, *(f"@{i}" for i in range(_MOST_ATOMS))])
        self._gens = self._ring.gens()
        self._one = self._number(1.0)
        self._roots = [self.of(formula) for formula in self.positive]

    def of(self, expression: Expression) -> Ratio:
        """Return the normal form. TooLongError, ZeroDivisionError: there is none."""
        for node in all_nodes(expression):
            if id(node) not in self._known:  # the node is kept, so that no other one gets its id
                inner = [self._known[id(operand)][1] for operand in operands(node)]
                self._known[id(node)] = node, self._of(node, inner)
        return self._known[id(expression)][1]

    def are_equal(self, a: Expression, b: Expression) -> bool:
        """Whether two formulas have the same normal form."""
        return not self._reduced(self.of(a) - self.of(b)).numerator

    def point_alike(self, a: Expression, b: Expression) -> bool:
        """Whether two angles have the same sine and cosine: they differ by whole turns."""
        return all(
            not self._reduced(p - q).numerator
            for p, q in zip(self._turn(self.of(a)), self._turn(self.of(b)), strict=True)
        )

    def _of(self, node: Expression, inner: list[Ratio]) -> Ratio:
        match node:
            case Constant(value):
                found = self._number(value)
            case Variable(name):
                found = self._ratio(self._gens[self._names.index(name)])
            case Binary():
                found = self._reduced(_combined(node, *inner))
            case Power(_, exponent) if exponent.is_integer() and abs(exponent) <= _MOST_MULTIPLIED:
                found = self._power(inner[0], int(exponent))
            case Power(_, exponent):
                found = self._atom(f"^{exponent!r}", (inner[0],))
            case Function(name):
                found = self._function(name, inner[0])
            case Angle():
                self._size(*inner)  # roots are known before products of them are met
                found = self._atom("atan2", (inner[0], inner[1]))
            case _:
                raise TypeError(f"not an expression: {node!r}")
        return found

    def _function(self, name: str, argument: Ratio) -> Ratio:
        if name in ("sin", "cos"):
            return self._turn(argument)[name == "sin"]
        return self._root(argument) if name == "sqrt" else self._atom(name, (argument,))

    def _number(self, value: float) -> Ratio:
        return self._ratio(self._ring.constant(as_fmpq(value)))

    def _ratio(self, polynomial: fmpq_mpoly) -> Ratio:
        return Ratio(polynomial, self._ring.constant(1))

    def _power(self, base: Ratio, exponent: int) -> Ratio:
        found = self._one
        for _ in range(abs(exponent)):
            found = self._reduced(found * base)
        return found if exponent >= 0 else self._one / found

    def _root(self, of: Ratio) -> Ratio:
        for p in self._roots:
            if self._same(of, self._reduced(p * p)):
                return p
        number = None if of.constant is None else square_root(of.constant)
        if number is not None:
            return self._ratio(self._ring.constant(number))
        known = [atom for atom in self._atoms if atom.function == "sqrt"]
        for atom in known:
            factor = (of / atom.arguments[0]).constant if atom.arguments[0].numerator else None
            root = None if factor is None else square_root(factor)
            if root is not None and root > 0:
                return self._ratio(self._ring.constant(root)) * atom.value
        for i, a in enumerate(known):
            for b in known[i:]:
                product = self._reduced(a.arguments[0] * b.arguments[0])
                if self._same(of, product):
                    return self._reduced(a.value * b.value)
                factor = (of / product).constant if product.numerator else None
                root = None if factor is None else square_root(factor)
                if root is not None and root > 0:
                    return self._ratio(self._ring.constant(root)) * self._reduced(a.value * b.value)
        return self._atom("sqrt", (of,), of)

    def _size(self, a: Ratio, b: Ratio) -> Ratio:
        return self._root(self._reduced(a * a + b * b))

    def _turn(self, angle: Ratio) -> tuple[Ratio, Ratio]:
        """Return cosine and sine."""
        found = self._one, self._number(0.0)
        for piece, times in self._pieces(angle):
            by = self._cosine_and_sine(piece)
            for _ in range(abs(times)):
                found = self._rotated(found, by if times > 0 else (by[0], -by[1]))
        return found

    def _pieces(self, angle: Ratio) -> list[tuple[Ratio, int]]:
        """Cut an angle into terms, each with how often it is there; terms have positive factors."""
        pieces = []
        for monomial, coefficient in angle.numerator.to_dict().items():
            positive = coefficient if coefficient > 0 else -coefficient
            times = int(positive) if positive.q == 1 and positive <= _MOST_MULTIPLIED else 1
            term = self._ring.from_dict({monomial: positive / times})
            pieces.append((Ratio.of(term, angle.denominator), times if coefficient > 0 else -times))
        return pieces

    def _cosine_and_sine(self, piece: Ratio) -> tuple[Ratio, Ratio]:
        atom = next((atom for atom in self._atoms if atom.value == piece), None)
        if atom is not None and atom.function == "atan2":
            y, x = atom.arguments
            size = self._size(y, x)
            return x / size, y / size
        if atom is not None and atom.function == "atan":
            (w,) = atom.arguments
            size = self._size(self._one, w)
            return self._one / size, w / size
        cosine = self._atom("cos", (piece,))
        return cosine, self._atom("sin", (piece,), self._one - cosine * cosine)

    def _rotated(self, a: tuple[Ratio, Ratio], b: tuple[Ratio, Ratio]) -> tuple[Ratio, Ratio]:
        cosine, sine = a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]
        return self._reduced(cosine), self._reduced(sine)

    def _atom(self, function: str, arguments: tuple[Ratio, ...], square: Ratio | None = None) -> Ratio:
        for atom in self._atoms:
            if atom.function == function and all(map(self._same, atom.arguments, arguments)):
                return atom.value
        if len(self._atoms) == _MOST_ATOMS:
            raise TooLongError(f"there are more than {_MOST_ATOMS} different values of functions")
        value = self._ratio(self._gens[len(self._names) + len(self._atoms)])
        self._atoms.append(_Atom(function, arguments, value, square))
        return value

    def _same(self, a: Ratio, b: Ratio) -> bool:
        return not self._reduced(a - b).numerator

    def _reduced(self, of: Ratio) -> Ratio:
        """Replace squares of atoms for which there is a rule; atoms are made of earlier ones only."""
        for i in reversed(range(len(self._atoms))):
            square, place = self._atoms[i].square, len(self._names) + i
            if square is not None:
                numerator, denominator = (self._without(p, place, square) for p in (of.numerator, of.denominator))
                if numerator is not None or denominator is not None:
                    of = (numerator or self._ratio(of.numerator)) / (denominator or self._ratio(of.denominator))
        return of

    def _without(self, polynomial: fmpq_mpoly, place: int, square: Ratio) -> Ratio | None:
        """Return the polynomial with `square` for the square of one variable; None if it is not in it."""
        if polynomial.degrees()[place] < 2:
            return None
        by_power: dict[int, dict[tuple[int, ...], fmpq]] = {}
        for monomial, coefficient in polynomial.to_dict().items():
            power = monomial[place]
            left = (*monomial[:place], power % 2, *monomial[place + 1 :])
            by_power.setdefault(power // 2, {})[left] = coefficient
        total, factor = self._number(0.0), self._one
        for power in range(max(by_power) + 1):
            if power in by_power:
                total = total + self._ratio(self._ring.from_dict(by_power[power])) * factor
            factor = factor * square
        return total


def _combined(node: Expression, a: Ratio, b: Ratio) -> Ratio:
    match node:
        case Sum():
            return a + b
        case Difference():
            return a - b
        case Product():
            return a * b
    return a / b
