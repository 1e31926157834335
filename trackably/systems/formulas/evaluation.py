"""Evaluate expressions: in float64, or in any other arithmetic, such as balls."""

from collections.abc import Mapping
from typing import Protocol, TypeVar

import numpy as np

from trackably.arrays import Array
from trackably.systems.formulas.expression import (
    Angle,
    Binary,
    Constant,
    Expression,
    Function,
    Power,
    Variable,
)

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
