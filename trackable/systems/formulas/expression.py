"""Formulas as data: written once in ordinary arithmetic, then evaluated with floats or balls, differentiated, stored.

An expression is a graph of the nodes below. A constant is the real number that its float64 is, and no rule here changes
the real function that a formula stands for, or where it is defined.
"""

import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from trackable.arrays import Array

V = TypeVar("V")

FUNCTIONS = ("exp", "log", "sqrt", "sin", "cos")
"""What there is beside + − · / and powers; NumPy's names."""


class Expression:
    """A node of a formula; `str` is how it would be written."""

    def __str__(self) -> str:
        return _text(self, 0)


@dataclass(frozen=True)
class Constant(Expression):
    """A finite number, exactly."""

    value: float


@dataclass(frozen=True)
class Variable(Expression):
    """Whatever is called so."""

    name: str


@dataclass(frozen=True)
class Binary(Expression):
    """left ∘ right, with ∘ as in `symbol`."""

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


@dataclass(frozen=True)
class Power(Expression):
    """base^exponent with a number for exponent: where base > 0, and everywhere (but for 1/0) if that is whole."""

    base: Expression
    exponent: float


@dataclass(frozen=True)
class Function(Expression):
    """One of `FUNCTIONS` of an argument."""

    name: str
    argument: Expression


BINARY: tuple[type[Binary], ...] = (Sum, Difference, Product, Quotient)
ONE = Constant(1.0)


class Arithmetic(Protocol[V]):
    """What evaluation needs of numbers V that have + − · / already."""

    def constant(self, value: float) -> V: ...

    def power(self, base: V, exponent: float) -> V: ...

    def function(self, name: str, argument: V) -> V: ...


def evaluate(expression: Expression, values: Mapping[str, V], arithmetic: Arithmetic[V]) -> V:
    """The value where variables have these values; what is shared in the graph is computed once."""
    known: dict[int, V] = {}
    for node in parts(expression):
        known[id(node)] = _computed(node, [known[id(operand)] for operand in operands(node)], values, arithmetic)
    return known[id(expression)]


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
        case _:
            raise TypeError(f"no expression: {node!r}")
    return found


class _Floats:
    """NumPy's arithmetic, silent where something is not defined: that is NaN or infinite then."""

    def constant(self, value: float) -> Array:
        return np.asarray(np.float64(value))

    def power(self, base: Array, exponent: float) -> Array:
        return np.asarray(np.power(base, exponent))

    def function(self, name: str, argument: Array) -> Array:
        return np.asarray(getattr(np, name)(argument))


def at_floats(expression: Expression, values: Mapping[str, Array]) -> Array:
    """The value in float64, elementwise in arrays that fit each other; NaN or infinite where it is not defined."""
    with np.errstate(all="ignore"):
        return np.asarray(evaluate(expression, values, _Floats()))


def parts(expression: Expression) -> Iterator[Expression]:
    """Every node of the graph, each once, operands before what is made of them."""
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
    """What a node is made of."""
    match node:
        case Binary(left, right):
            return left, right
        case Power(base, _):
            return (base,)
        case Function(_, argument):
            return (argument,)
    return ()


def variables(expression: Expression) -> frozenset[str]:
    """Names of all variables in it."""
    return frozenset(node.name for node in parts(expression) if isinstance(node, Variable))


def size_and_depth(expression: Expression) -> tuple[int, int]:
    """How many nodes it has if written out (what is shared counts each time), and how many lie within each other."""
    known: dict[int, tuple[int, int]] = {}
    for node in parts(expression):
        inner = [known[id(operand)] for operand in operands(node)]
        known[id(node)] = 1 + sum(size for size, _ in inner), 1 + max((depth for _, depth in inner), default=0)
    return known[id(expression)]


_BINDING = {Sum: 1, Difference: 1, Product: 2, Quotient: 2}


def _text(node: Expression, binding: int) -> str:
    """How it is written where what stands around it binds so closely."""
    match node:
        case Constant(value):
            return f"{value:g}" if value >= 0 or not binding else f"({value:g})"
        case Variable(name):
            return name
        case Binary(left, right):
            own = _BINDING[type(node)]
            inner = f"{_text(left, own)} {node.symbol} {_text(right, own + 1)}"
            return inner if own >= binding else f"({inner})"
        case Power(base, exponent):
            inner = f"{_text(base, 4)}^{_text(Constant(exponent), 4)}"
            return inner if binding < 4 else f"({inner})"
        case Function(name, argument):
            return f"{name}({_text(argument, 0)})"
    raise TypeError(f"no expression: {node!r}")
