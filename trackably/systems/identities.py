"""Verify that a flat form is one of x⁺ = f(x, u): f(X(z), U(z)) = X(z one step later), as an identity.

Both sides are compared by normal forms (`formulas.normal`): so the identity holds wherever all parts are defined. Most
states and inputs are not written out where the identity holds whatever their values are (`formulas.hiding`). For a
state that is an angle, both sides have the same sine and cosine; then f must turn with its angles: if a state in
`angles` is turned by 2π, f changes by whole turns of the angles, and by nothing else. So there are whole turns which,
added to the angles of X at each step, give states that f follows exactly.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import isqrt

import numpy as np
from flint import Ordering, fmpq, fmpq_mpoly, fmpq_mpoly_ctx

from trackably.systems.expressions import (
    Angle,
    Binary,
    Constant,
    Difference,
    Expression,
    Function,
    Power,
    Product,
    Quotient,
    Shapes,
    Sum,
    Variable,
    all_nodes,
    evaluate_floats,
    hideable,
    operands,
    outline,
    substituted,
    variables,
)
from trackably.systems.flat_forms import FlatForm, one_step_later

# What must hold so that formulas have values: divisors are not zero, arguments of roots and logarithms positive.

MOST_MULTIPLIED = 64
"""Powers with whole exponents up to this size are repeated multiplication; others are exp(p log x), for x > 0."""

_NEEDS_POSITIVE = {"log", "sqrt"}


@dataclass(frozen=True)
class Requirement:
    """The `formula` is positive, or, if it may be negative too, only not zero."""

    formula: Expression
    may_be_negative: bool

    def __str__(self) -> str:
        return f"{outline(self.formula)} {'≠' if self.may_be_negative else '>'} 0"


def requirements(formulas: Iterable[Expression]) -> tuple[Requirement, ...]:
    """Return what these formulas need to be defined, once each; numbers that fulfil it are left out."""
    found: dict[Requirement, None] = {}
    for formula in formulas:
        for node in all_nodes(formula):
            needed = _needed(node)
            if needed is not None and not _is_fulfilled(needed):
                found[needed] = None
    return tuple(found)


def _needed(node: Expression) -> Requirement | None:
    match node:
        case Quotient(_, b):
            return Requirement(b, may_be_negative=True)
        case Function(name, argument) if name in _NEEDS_POSITIVE:
            return Requirement(argument, may_be_negative=False)
        case Power(base, exponent) if not exponent.is_integer() or abs(exponent) > MOST_MULTIPLIED:
            return Requirement(base, may_be_negative=False)
        case Power(base, exponent) if exponent < 0:
            return Requirement(base, may_be_negative=True)
        case Angle(y, x):
            return Requirement(Sum(Power(x, 2.0), Power(y, 2.0)), may_be_negative=False)
    return None


def _is_fulfilled(needed: Requirement) -> bool:
    number = needed.formula.value if isinstance(needed.formula, Constant) else 0.0
    return number > 0 or (needed.may_be_negative and number != 0)


# Quotients of polynomials with rational coefficients, in lowest terms.

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


# Normal forms, by which formulas are shown to be equal: quotients of polynomials in variables and roots, sines, ….
#
# Each value of a function that is no polynomial is a new variable, an atom, with what is known about it:
#
# - √a has the square a; it is q √b · √c if a = q² b c for known roots and a number q, q √b if a = q² b, q if a = q²,
#   and p if a = p² for a formula p that is known to be positive;
# - sin² a is 1 − cos² a; sines and cosines of sums of terms are those of the terms; with v = (x, y), sin(atan2(y, x))
#   is y/|v| and cos(atan2(y, x)) is x/|v|, where |v| = √(x² + y²); sin(atan w) is w/√(1 + w²) and cos(atan w) 1/√(1 +
#   w²).
#
# Formulas with equal normal forms are equal wherever all their parts are defined, v ≠ 0, and `positive` formulas are
# positive. Formulas with different normal forms may be equal all the same.

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


_TRIALS, _SPREADS, _CLEARLY = 20, (0.3, 1.0, 3.0), 1e-6


def with_flat_form(f: Sequence[Expression], form: FlatForm, names: Sequence[str]) -> tuple[Expression, ...]:
    """Return f(X(z), U(z)): f with the formulas of states and inputs, whose `names` are in their order."""
    formulas = dict(zip(names, (*form.states, *form.inputs), strict=True))
    return tuple(substituted(formula, formulas) for formula in f)


def needs(f: Sequence[Expression], form: FlatForm, names: Sequence[str]) -> tuple[Requirement, ...]:
    """Return what must hold at a time t so that x(t), x(t + T), u(t) and f(x(t), u(t)) are defined, and so that the
    identity holds."""
    later = [one_step_later(formula) for formula in form.states]
    of_positive = (*form.positive, *(Function("log", p) for p in form.positive))
    return requirements((*form.states, *form.inputs, *later, *with_flat_form(f, form, names), *of_positive))


def why_not_flat(f: Sequence[Expression], form: FlatForm, states: Sequence[str], inputs: Sequence[str]) -> str | None:
    """Return why this is no flat form of f, or is not shown to be one; None if it is."""
    if (len(form.states), len(form.inputs)) != (len(states), len(inputs)):
        return (
            f"has formulas of {len(form.states)} states and {len(form.inputs)} inputs, but the system has "
            f"{len(states)} and {len(inputs)}"
        )
    if unknown := {*form.angles} - {*states}:
        return f"calls {min(unknown)} an angle, which is no state"
    for state, formula in zip(states, f, strict=True):
        for angle in form.angles:
            turned = turns(formula, angle)
            if turned is None or (turned and state not in form.angles):
                return f"calls {angle} an angle, but the formula of {state} changes if it is turned by 2π"
    later = [one_step_later(formula) for formula in form.states]
    reached = with_flat_form(f, form, (*states, *inputs))
    if (why := _unequal(form, later, reached, states)) is None:
        return None
    for state, a, b in zip(states, reached, later, strict=True):
        off: Expression = Difference(a, b)
        if state in form.angles:  # zero for whole turns
            off = Function("sin", Product(Constant(0.5), off))
        if found := _not_zero(off, form.positive):
            return f"is not one of f: one step later {state} is off{found}"
    return why


def turns(formula: Expression, angle: str) -> int | None:
    """Return n such that the formula changes by 2π n whenever the angle does by 2π; None where no n is seen."""
    inner = [turns(operand, angle) for operand in operands(formula)]
    found = None if any(n != 0 for n in inner) else 0
    match formula, inner:
        case Variable(name), _:
            found = int(name == angle)
        case Sum(), [int(a), int(b)]:
            found = a + b
        case Difference(), [int(a), int(b)]:
            found = a - b
        case Product(Constant(value), _), [_, int(b)] if value.is_integer():
            found = int(value) * b
        case Product(_, Constant(value)), [int(a), _] if value.is_integer():
            found = int(value) * a
        case Function("sin" | "cos"), [int()]:
            found = 0
    return found


def _not_zero(error: Expression, positive: Sequence[Expression]) -> str | None:
    """Return where a formula is clearly not zero in float64; None where that is not seen."""
    names = sorted({name for formula in (error, *positive) for name in variables(formula)})
    rng = np.random.default_rng(0)
    for spread in np.repeat(_SPREADS, _TRIALS):
        at = {name: np.asarray(value) for name, value in zip(names, rng.normal(1.0, spread, len(names)), strict=True)}
        off = float(evaluate_floats(error, at))
        if not all(evaluate_floats(p, at) > 0 for p in positive):
            continue
        if np.isfinite(off) and abs(off) > _CLEARLY * (1 + max(map(abs, map(float, at.values())), default=0.0)):
            where = ", ".join(f"{name} = {float(value):.4g}" for name, value in at.items())
            return f" where {where}"
    return None


def _unequal(
    form: FlatForm, later: Sequence[Expression], reached: Sequence[Expression], states: Sequence[str]
) -> str | None:
    """Return why the identity is not shown; None if it is."""
    try:
        whole: NormalForms | None = None
        for state, a, b in zip(states, reached, later, strict=True):
            if state not in form.angles and _equal_whatever_parts_are(form, later, a, b):
                continue
            whole = whole or _normal_forms(form, later)
            if not (whole.point_alike(a, b) if state in form.angles else whole.are_equal(a, b)):
                return f"is not shown to be one of f: {state} may differ from that one step later"
    except (TooLongError, ZeroDivisionError) as error:
        return f"is not shown to be one of f: {error}"
    return None


def _normal_forms(form: FlatForm, later: Sequence[Expression]) -> NormalForms:
    every = (*form.states, *later, *form.inputs)
    found = NormalForms(_names((*every, *form.positive)), form.positive)
    for formula in every:
        found.of(formula)  # their roots are known before products of them are met
    return found


def _equal_whatever_parts_are(form: FlatForm, later: Sequence[Expression], a: Expression, b: Expression) -> bool:
    """Whether a = b for all values of states and inputs but one, which is written out: as chains solve for them."""
    shapes = Shapes()
    hidden = hideable((*form.states, *form.inputs, *later), shapes)
    for shown in sorted(hideable((*form.states, *form.inputs), shapes)) or [-1]:
        p, q, *positive = (shapes.without(formula, hidden - {shown}) for formula in (a, b, *form.positive))
        try:
            if NormalForms(_names((p, q, *positive)), positive).are_equal(p, q):
                return True
        except (TooLongError, ZeroDivisionError):
            continue
    return False


def _names(formulas: Sequence[Expression]) -> Iterator[str]:
    yield from {name for formula in formulas for name in variables(formula)}
