"""Formulas of a plant, built of the checker's nodes: values and derivatives in float64, and the form in files.

A formula is an acyclic graph of the checker's nodes. A constant is exactly the real number that its float64 represents.
"""

import sys
from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np

from trackably.arrays import Array
from trackably.checker.formulas import (
    OPERATORS,
    Angle,
    Formula,
    Function,
    Name,
    Number,
    Operation,
    Power,
    operands,
    parts,
    text,
)

ONE = Number(1.0)


def is_float64(value: object) -> bool:
    """Whether a value is a finite number that float64 represents exactly."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max and float(value) == value


def size_and_depth(formula: Formula) -> tuple[int, int]:
    """Return the number of operations, names and numbers in the written formula, and its depth of nesting."""
    known: dict[Formula, tuple[int, int]] = {}
    for node in parts(formula):
        inner = [known[operand] for operand in operands(node)]
        known[node] = 1 + sum(size for size, _ in inner), 1 + max((depth for _, depth in inner), default=0)
    return known[formula]


def plain_text(formula: Formula) -> str:
    """Return a formula as text for people: without the quotes and the outermost parentheses of the checker's text."""
    found = text(formula).replace('"', "")
    return found[1:-1] if isinstance(formula, Operation | Power) else found


def to_lists(formula: Formula) -> object:
    """Convert a formula to JSON values: a number, a name, or a list like ["+", …, …], ["^", …, 0.5], ["sqrt", …]."""
    inner = [to_lists(operand) for operand in operands(formula)]
    match formula:
        case Number(value):
            return value
        case Name(name):
            return name
        case Power(_, exponent):
            return ["^", *inner, exponent]
        case Operation(symbol) | Function(symbol):
            return [symbol, *inner]
    return ["atan2", *inner]


# Values in float64.


@lru_cache(maxsize=4096)
def steps(formula: Formula) -> tuple[tuple[Formula, tuple[int, ...]], ...]:
    """Return every node of a formula once, operands first, each with the indices of its operands in the result."""
    places = {node: place for place, node in enumerate(parts(formula))}
    return tuple((node, tuple(places[operand] for operand in operands(node))) for node in places)


_NUMPY = {"atan": "arctan"}


def evaluate_floats(formula: Formula, values: Mapping[str, Array | float]) -> Array:
    """Evaluate a formula in float64, elementwise over arrays that broadcast; NaN or infinite outside its domain."""
    return _values_of_parts(formula, values)[-1]


def _values_of_parts(formula: Formula, values: Mapping[str, Array | float]) -> list[Array]:
    """Return the values of all parts of a formula, in the order of `steps`."""
    known: list[Array] = []
    with np.errstate(all="ignore"):
        for node, places in steps(formula):
            inner = [known[place] for place in places]
            match node:
                case Number(value):
                    found = np.array(value)
                case Name(name):
                    found = np.asarray(values[name])
                case Operation(symbol):
                    found = OPERATORS[symbol](*inner)
                case Power(_, exponent):
                    found = np.power(inner[0], exponent)
                case Function(name):
                    found = getattr(np, _NUMPY.get(name, name))(inner[0])
                case Angle():
                    y, x = inner
                    found = np.where((y == 0) & (x == 0), np.nan, np.arctan2(y, x))
            known.append(np.asarray(found))
    return known


def slopes_in_floats(formula: Formula, values: Mapping[str, Array | float]) -> dict[str, Array]:
    """Return the derivatives of a formula in float64, by the names that it uses; values are as for `evaluate_floats`.

    The chain rule is applied backwards, from the formula to its names, so that one pass gives all derivatives.
    """
    known, found = _values_of_parts(formula, values), dict[str, Array]()
    outer = [np.zeros(()) for _ in known[1:]] + [np.ones(())]  # derivatives of the formula by each of its parts
    with np.errstate(all="ignore"):
        for i in reversed(range(len(known))):
            node, places = steps(formula)[i]
            if isinstance(node, Name):
                found[node.name] = found.get(node.name, 0.0) + outer[i]
            inner = _slopes_of_part(node, known[i], [known[place] for place in places])
            for place, slope in zip(places, inner, strict=True):
                outer[place] = outer[place] + outer[i] * slope
    return found


def _slopes_of_part(node: Formula, value: Array, operands: list[Array]) -> tuple[Array | float, ...]:
    """Return the derivatives of one part of a formula with respect to its operands; `value` is that of the part."""
    slopes: tuple[Array | float, ...] = ()
    match node, operands:
        case Operation("+"), _:
            slopes = 1.0, 1.0
        case Operation("-"), _:
            slopes = 1.0, -1.0
        case Operation("*"), [a, b]:
            slopes = b, a
        case Operation("/"), [_, b]:
            slopes = 1 / b, -value / b
        case Power(_, exponent), [base]:
            slopes = (exponent * np.power(base, exponent - 1) if exponent else 0.0,)
        case Function(name), [x]:
            slopes = (_SLOPES[name](x, value),)
        case Angle(), [y, x]:
            slopes = x / (x**2 + y**2), -y / (x**2 + y**2)
    return slopes


_SLOPES: dict[str, Callable[[Array, Array], Array]] = {
    "exp": lambda x, value: value,
    "log": lambda x, value: 1 / x,
    "sqrt": lambda x, value: 0.5 / value,
    "sin": lambda x, value: np.cos(x),
    "cos": lambda x, value: -np.sin(x),
    "atan": lambda x, value: 1 / (1 + x**2),
}
