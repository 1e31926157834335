"""Formulas as data: to be evaluated in floats or balls, differentiated, solved and stored.

An expression is an acyclic graph of the nodes below. A constant is exactly the real number that its float64 is. No
operation on expressions changes the real function that a formula represents, or its domain.
"""

import operator
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

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
