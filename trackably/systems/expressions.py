"""Formulas as data: to be evaluated in floats or balls, differentiated, solved and stored.

An expression is an acyclic graph of the nodes below. A constant is exactly the real number that its float64 is. No
operation on expressions changes the real function that a formula represents, or its domain.
"""

import operator
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from reprlib import repr as short
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from trackably.arrays import Array

FUNCTIONS = ("exp", "log", "sqrt", "sin", "cos", "atan")
"""The functions of one argument, as NumPy has them (it calls atan arctan)."""


class Expression:
    """A node of a formula; `str` gives the formula as text, `repr` its outer parts."""

    @cached_property
    def steps(self) -> "tuple[tuple[Expression, tuple[int, ...]], ...]":
        """Every node of the graph once, operands before the node that uses them, with the places of its operands."""
        places: dict[int, int] = {}
        for node in all_nodes(self):
            places[id(node)] = len(places)
        return tuple((node, tuple(places[id(operand)] for operand in operands(node))) for node in all_nodes(self))

    def __str__(self) -> str:
        return _text(self, 0, _ALL)

    def __repr__(self) -> str:
        return _text(self, 0, _PRINTED)


@dataclass(frozen=True, repr=False)
class Constant(Expression):
    """A finite number, exactly."""

    value: float


@dataclass(frozen=True, repr=False)
class Variable(Expression):
    """A variable, by its name."""

    name: str


@dataclass(frozen=True, repr=False)
class Binary(Expression):
    """left ∘ right, where `symbol` is ∘."""

    left: Expression
    right: Expression
    symbol: ClassVar[str]
    operate: ClassVar[Callable[[Any, Any], Any]]


class Sum(Binary):
    """left + right."""

    symbol = "+"
    operate = operator.add


class Difference(Binary):
    """left − right."""

    symbol = "-"
    operate = operator.sub


class Product(Binary):
    """left · right."""

    symbol = "*"
    operate = operator.mul


class Quotient(Binary):
    """left / right, where right is not zero."""

    symbol = "/"
    operate = operator.truediv


@dataclass(frozen=True, repr=False)
class Power(Expression):
    """base^exponent with a constant exponent: defined for base > 0; for a whole exponent everywhere, except 1/0."""

    base: Expression
    exponent: float


@dataclass(frozen=True, repr=False)
class Function(Expression):
    """One of `FUNCTIONS`, applied to an argument."""

    name: str
    argument: Expression


@dataclass(frozen=True, repr=False)
class Angle(Expression):
    """The angle of the vector (x, y), atan2(y, x) in (−π, π]: not defined where both are zero."""

    y: Expression
    x: Expression


BINARY: tuple[type[Binary], ...] = (Sum, Difference, Product, Quotient)
ONE = Constant(1.0)


def is_float64(value: object) -> bool:
    """Whether a value is a finite number that float64 represents exactly."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max and float(value) == value


def all_nodes(expression: Expression) -> Iterator[Expression]:
    """Yield every node of the graph once, operands before the node that uses them."""
    seen: set[int] = set()

    def walk(node: Expression) -> Iterator[Expression]:
        if id(node) in seen:
            return
        seen.add(id(node))
        for operand in operands(node):
            yield from walk(operand)
        yield node

    return walk(expression)


def operands(node: Expression) -> tuple[Expression, ...]:
    """Return the operands of a node."""
    match node:
        case Binary(left, right):
            return left, right
        case Power(base, _):
            return (base,)
        case Function(_, argument):
            return (argument,)
        case Angle(y, x):
            return y, x
    return ()


def variables(expression: Expression) -> frozenset[str]:
    """Return the names of all variables in an expression."""
    return frozenset(node.name for node in all_nodes(expression) if isinstance(node, Variable))


def size_and_depth(expression: Expression) -> tuple[int, int]:
    """Return the number of nodes of the written formula (shared ones count each time), and how deep it is nested."""
    known: dict[int, tuple[int, int]] = {}
    for node in all_nodes(expression):
        inner = [known[id(operand)] for operand in operands(node)]
        known[id(node)] = 1 + sum(size for size, _ in inner), 1 + max((depth for _, depth in inner), default=0)
    return known[id(expression)]


_OUTER, _PRINTED, _ALL = 6, 12, 10_000
_BINDING = {Sum: 1, Difference: 1, Product: 2, Quotient: 2}


def outline(expression: Expression) -> str:
    """Format the outer parts of a formula; what is nested deeper is "…"."""
    return _text(expression, 0, _OUTER)


def _text(node: Expression, binding: int, deepest: int) -> str:
    """Format a node inside an operator that binds with this strength, in parentheses if needed."""
    match node:
        case _ if not deepest:
            found = "…"
        case Constant(value):
            found = f"{value:g}" if value >= 0 or not binding else f"({value:g})"
        case Variable(name):
            found = name
        case Binary(left, right):
            own = _BINDING[type(node)]
            inner = f"{_text(left, own, deepest - 1)} {node.symbol} {_text(right, own + 1, deepest - 1)}"
            found = inner if own >= binding else f"({inner})"
        case Power(base, exponent):
            inner = f"{_text(base, 4, deepest - 1)}^{_text(Constant(exponent), 4, 1)}"
            found = inner if binding < 4 else f"({inner})"
        case Function(name, argument):
            found = f"{name}({_text(argument, 0, deepest - 1)})"
        case Angle(y, x):
            found = f"atan2({_text(y, 0, deepest - 1)}, {_text(x, 0, deepest - 1)})"
        case _:
            raise TypeError(f"not an expression: {type(node).__name__}")
    return found


# Put formulas in the place of variables.


def substituted(
    expression: Expression, formulas: Mapping[str, Expression], parts: Mapping[Expression, Expression] | None = None
) -> Expression:
    """Return the expression with these formulas in the place of the variables that they are named after.

    What is in `parts` is replaced first, wherever it is.
    """
    known: dict[int, Expression] = {}
    for node in all_nodes(expression):
        inner = [known[id(operand)] for operand in operands(node)]
        known[id(node)] = parts[node] if parts and node in parts else _with_formulas(node, inner, formulas)
    return known[id(expression)]


def _with_formulas(node: Expression, inner: list[Expression], formulas: Mapping[str, Expression]) -> Expression:
    return formulas.get(node.name, node) if isinstance(node, Variable) else rebuilt(node, inner)


def rebuilt(node: Expression, inner: list[Expression]) -> Expression:
    """Return a node with other operands."""
    match node:
        case Binary():
            return type(node)(*inner)
        case Power(_, exponent):
            return Power(inner[0], exponent)
        case Function(name, _):
            return Function(name, inner[0])
        case Angle():
            return Angle(*inner)
    return node


# Put variables in the place of parts of formulas: what holds whatever their values are holds for these parts too.


@dataclass(frozen=True)
class Shapes:
    """Numbers of formulas: equal for those that are written alike."""

    _known: dict[int, tuple[Expression, int]] = field(default_factory=dict)
    _numbers: dict[object, int] = field(default_factory=dict)
    _shared: dict[int, Expression] = field(default_factory=dict)

    def of(self, expression: Expression) -> int:
        """Return the number of a formula."""
        for node in all_nodes(expression):
            if id(node) not in self._known:  # the node is kept, so that no other one gets its id
                inner = tuple(self._known[id(operand)][1] for operand in operands(node))
                key = (type(node), _own_part(node), inner)
                self._known[id(node)] = node, self._numbers.setdefault(key, len(self._numbers))
        return self._known[id(expression)][1]

    def shared(self, expression: Expression) -> Expression:
        """Return the formula with one object for all parts that are written alike, in all formulas given so far."""
        self.of(expression)
        for node in all_nodes(expression):
            number = self._known[id(node)][1]
            if number not in self._shared:
                inner = [self._shared[self._known[id(operand)][1]] for operand in operands(node)]
                self._shared[number] = rebuilt(node, inner)
        return self._shared[self._known[id(expression)][1]]

    def without(self, expression: Expression, hidden: Collection[int]) -> Expression:
        """Return the formula with variables for the largest parts whose numbers are `hidden`."""
        self.of(expression)
        done: dict[int, Expression] = {}
        return self._without(expression, hidden, done)

    def _without(self, node: Expression, hidden: Collection[int], done: dict[int, Expression]) -> Expression:
        if id(node) not in done:
            number = self._known[id(node)][1]
            if number in hidden:
                done[id(node)] = Variable(f"#{number}")
            else:
                inner = [self._without(operand, hidden, done) for operand in operands(node)]
                done[id(node)] = rebuilt(node, inner)
        return done[id(node)]


def _own_part(node: Expression) -> object:
    match node:
        case Constant(value):
            return value
        case Variable(name) | Function(name, _):
            return name
        case Power(_, exponent):
            return exponent
    return None


def hideable(formulas: Sequence[Expression], shapes: Shapes) -> set[int]:
    """Return the numbers of formulas that are no variables or numbers themselves."""
    return {shapes.of(formula) for formula in formulas if not isinstance(formula, Variable | Constant)}


# Sums, products and derivatives of expressions, without trivial terms and factors.

Term = Expression | None
"""An expression, or None for zero: terms and products that vanish are not written down."""

_MINUS_ONE = Constant(-1.0)


def plus(a: Term, b: Term) -> Term:
    """Return a + b."""
    if a is None or b is None:
        return b if a is None else a
    return Sum(a, b)


def minus(a: Term, b: Term) -> Term:
    """Return a − b."""
    if b is None:
        return a
    return Product(_MINUS_ONE, b) if a is None else Difference(a, b)


def times(a: Term, b: Term) -> Term:
    """Return a · b."""
    if a is None or b is None:
        return None
    if ONE in (a, b):
        return b if a == ONE else a
    return Product(a, b)


def over(a: Term, b: Expression) -> Term:
    """Return a / b."""
    return None if a is None else Quotient(a, b)


def derivative(expression: Expression, *names: str) -> Term:
    """Return the exact derivative in the variable of this name, or in x if all these variables are x plus constants."""
    known: dict[int, Term] = {}
    for node in all_nodes(expression):
        known[id(node)] = _slope(node, names, lambda operand: known[id(operand)])
    return known[id(expression)]


def _slope(node: Expression, names: tuple[str, ...], of: Callable[[Expression], Term]) -> Term:
    slope: Term = None
    match node:
        case Variable(own) if own in names:
            slope = ONE
        case Sum(a, b):
            slope = plus(of(a), of(b))
        case Difference(a, b):
            slope = minus(of(a), of(b))
        case Product(a, b):
            slope = plus(times(of(a), b), times(a, of(b)))
        case Quotient(a, b):
            slope = over(minus(of(a), times(node, of(b))), b)
        case Power(base, exponent):
            slope = times(_power_slope(node, base, exponent), of(base))
        case Function(function, argument) if (inner := of(argument)) is not None:
            slope = _FUNCTION_SLOPES[function](node, argument, inner)
        case Angle(y, x):
            turned = minus(times(x, of(y)), times(y, of(x)))
            slope = None if turned is None else Quotient(turned, Sum(Power(x, 2.0), Power(y, 2.0)))
    return slope


_FUNCTION_SLOPES: dict[str, Callable[[Expression, Expression, Expression], Term]] = {
    "exp": lambda node, argument, inner: times(node, inner),
    "log": lambda node, argument, inner: Quotient(inner, argument),
    "sqrt": lambda node, argument, inner: Quotient(inner, Product(Constant(2.0), node)),
    "sin": lambda node, argument, inner: times(Function("cos", argument), inner),
    "cos": lambda node, argument, inner: times(Product(_MINUS_ONE, Function("sin", argument)), inner),
    "atan": lambda node, argument, inner: Quotient(inner, Sum(ONE, Power(argument, 2.0))),
}


def _power_slope(node: Expression, base: Expression, exponent: float) -> Term:
    """Return p base^(p − 1), or p base^p / base if p is not whole: p − 1 may not be a float64."""
    if not exponent.is_integer():
        return Quotient(Product(Constant(exponent), node), base)
    lower = {0.0: None, 1.0: ONE, 2.0: base}.get(exponent, Power(base, exponent - 1))
    return times(Constant(exponent), lower)


# Evaluate expressions: in float64, or in any other arithmetic, such as balls.

V = TypeVar("V")


class Arithmetic(Protocol[V]):
    """Constants, powers and functions of a type of numbers V that has the operators + − · /."""

    def constant(self, value: float) -> V: ...

    def power(self, base: V, exponent: float) -> V: ...

    def function(self, name: str, argument: V) -> V: ...

    def angle(self, y: V, x: V) -> V: ...


def evaluate(expression: Expression, values: Mapping[str, V], arithmetic: Arithmetic[V]) -> V:
    """Evaluate an expression for these values of its variables; shared nodes are computed once."""
    known: list[V] = []
    for node, places in expression.steps:
        known.append(_computed(node, [known[place] for place in places], values, arithmetic))
    return known[-1]


def _computed(node: Expression, inner: list[V], values: Mapping[str, V], arithmetic: Arithmetic[V]) -> V:
    match node:
        case Constant(value):
            found = arithmetic.constant(value)
        case Variable(name):
            found = values[name]
        case Binary():
            found = type(node).operate(*inner)
        case Power(_, exponent):
            found = arithmetic.power(inner[0], exponent)
        case Function(name):
            found = arithmetic.function(name, inner[0])
        case Angle():
            found = arithmetic.angle(*inner)
        case _:
            raise TypeError(f"not an expression: {node!r}")
    return found


class _Floats:
    """NumPy's arithmetic: NaN or infinite outside the domain."""

    def constant(self, value: float) -> Array:
        return np.asarray(np.float64(value))

    def power(self, base: Array, exponent: float) -> Array:
        return np.asarray(np.power(base, exponent))

    def function(self, name: str, argument: Array) -> Array:
        return np.asarray(getattr(np, _NUMPY.get(name, name))(argument))

    def angle(self, y: Array, x: Array) -> Array:
        return np.asarray(np.where((y == 0) & (x == 0), np.nan, np.arctan2(y, x)))


_NUMPY = {"atan": "arctan"}


def evaluate_floats(expression: Expression, values: Mapping[str, Array]) -> Array:
    """Evaluate in float64, elementwise over arrays that broadcast; NaN or infinite outside the domain."""
    with np.errstate(all="ignore"):
        return np.asarray(evaluate(expression, values, _Floats()))


# Expressions as nested lists, the form in which JSON stores them.

MAX_DEPTH = 100
"""How deep a formula may be nested."""

_BINARY_OF = {kind.symbol: kind for kind in BINARY}


def to_lists(expression: Expression) -> object:
    """Convert to JSON values: a number, a name, or a list like ["+", …, …], ["^", …, 0.5], ["sqrt", …]."""
    match expression:
        case Constant(value):
            return value
        case Variable(name):
            return name
        case Binary(left, right):
            return [expression.symbol, to_lists(left), to_lists(right)]
        case Power(base, exponent):
            return ["^", to_lists(base), exponent]
        case Function(name, argument):
            return [name, to_lists(argument)]
        case Angle(y, x):
            return ["atan2", to_lists(y), to_lists(x)]
    raise TypeError(f"not an expression: {expression!r}")


def from_lists(data: object, depth: int = MAX_DEPTH) -> Expression:
    """Convert back from `to_lists`. ValueError: `data` is no such value, or nested more than `depth` deep."""
    if depth < 1:
        raise ValueError(f"a formula must not be nested more than {MAX_DEPTH} deep")
    match data:
        case int() | float() if is_float64(data):
            return Constant(float(data))
        case str():
            return Variable(data)
        case ["^", base, int() | float() as exponent] if is_float64(exponent):
            return Power(from_lists(base, depth - 1), float(exponent))
        case [str(name), argument] if name in FUNCTIONS:
            return Function(name, from_lists(argument, depth - 1))
        case ["atan2", y, x]:
            return Angle(from_lists(y, depth - 1), from_lists(x, depth - 1))
        case [str(symbol), left, right] if symbol in _BINARY_OF:
            return _BINARY_OF[symbol](from_lists(left, depth - 1), from_lists(right, depth - 1))
    raise ValueError(f"a formula must be a number, a name or a list that begins with an operation, got {short(data)}")


# Weighted sums as text, for names and messages.

_LONGEST = 80


def weighted_sum_text(row: Sequence[Fraction], names: Sequence[str], digits: int = 3) -> str:
    """Format Σ_i row_i name_i, as x, x+y or x-0.5y; weights with so many `digits`."""
    signed = []
    for weight, name in zip(map(float, row), names, strict=True):
        if weight:
            size = "" if abs(weight) == 1 else f"{abs(weight):.{digits}g}"
            signed.append(f"{'-' if weight < 0 else '+'}{size}{name}")
    return "".join(signed).removeprefix("+")


def shortened(name: str) -> str:
    """Shorten a name to fit into a line."""
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 1]}…"
