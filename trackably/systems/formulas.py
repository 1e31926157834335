"""Formulas of a plant, built of the checker's nodes: derivatives, values in float64, and the form in files.

A formula is an acyclic graph of the checker's nodes. A constant is exactly the real number that its float64 represents.
No operation here changes the real function that a formula represents, or its domain.
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
from trackably.checker.inverse import Term, minus, plus, times

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


def derivative(formula: Formula, name: str) -> Formula:
    """Return the exact derivative with respect to the variable `name`; the number 0 if it vanishes everywhere."""
    known: dict[Formula, Term] = {}
    for node in parts(formula):
        known[node] = _slope(node, name, [known[operand] for operand in operands(node)])
    return known[formula] or Number(0.0)


def _slope(node: Formula, name: str, inner: list[Term]) -> Term:
    slope: Term = None
    match node, inner:
        case Name(own), _ if own == name:
            slope = ONE
        case Operation("+"), [a, b]:
            slope = plus(a, b)
        case Operation("-"), [a, b]:
            slope = minus(a, b)
        case Operation("*", left, right), [a, b]:
            slope = plus(times(a, right), times(left, b))
        case Operation("/", _, right), [a, b]:
            above = minus(a, times(node, b))
            slope = None if above is None else Operation("/", above, right)
        case Power(base, exponent), [a]:
            slope = times(_power_slope(node, base, exponent), a)
        case Function(function, argument), [a] if a is not None:
            slope = _FUNCTION_SLOPES[function](node, argument, a)
        case Angle(y, x), [of_y, of_x]:
            turned = minus(times(x, of_y), times(y, of_x))
            squares = Operation("+", Power(x, 2.0), Power(y, 2.0))
            slope = None if turned is None else Operation("/", turned, squares)
    return slope


_FUNCTION_SLOPES: dict[str, Callable[[Formula, Formula, Formula], Term]] = {
    "exp": lambda node, argument, inner: times(node, inner),
    "log": lambda node, argument, inner: Operation("/", inner, argument),
    "sqrt": lambda node, argument, inner: Operation("/", inner, Operation("*", Number(2.0), node)),
    "sin": lambda node, argument, inner: times(Function("cos", argument), inner),
    "cos": lambda node, argument, inner: times(Operation("*", Number(-1.0), Function("sin", argument)), inner),
    "atan": lambda node, argument, inner: Operation("/", inner, Operation("+", ONE, Power(argument, 2.0))),
}


def _power_slope(node: Formula, base: Formula, exponent: float) -> Term:
    """Return d(base^p)/d(base) = p base^(p − 1).

    If p is no integer, this is written p base^p / base, because p − 1 may not be exact in float64.
    """
    if not exponent.is_integer():
        return Operation("/", Operation("*", Number(exponent), node), base)
    lower = {0.0: None, 1.0: ONE, 2.0: base}.get(exponent, Power(base, exponent - 1))
    return times(Number(exponent), lower)


# Values in float64.


@lru_cache(maxsize=4096)
def steps(formula: Formula) -> tuple[tuple[Formula, tuple[int, ...]], ...]:
    """Return every node of a formula once, operands first, each with the indices of its operands in the result."""
    places = {node: place for place, node in enumerate(parts(formula))}
    return tuple((node, tuple(places[operand] for operand in operands(node))) for node in places)


_NUMPY = {"atan": "arctan"}


def evaluate_floats(formula: Formula, values: Mapping[str, Array]) -> Array:
    """Evaluate a formula in float64, elementwise over arrays that broadcast; NaN or infinite outside its domain."""
    known: list[Array] = []
    with np.errstate(all="ignore"):
        for node, places in steps(formula):
            inner = [known[place] for place in places]
            match node:
                case Number(value):
                    found = np.asarray(np.float64(value))
                case Name(name):
                    found = values[name]
                case Operation(symbol):
                    found = OPERATORS[symbol](*inner)
                case Power(_, exponent):
                    found = np.asarray(np.power(inner[0], exponent))
                case Function(name):
                    found = np.asarray(getattr(np, _NUMPY.get(name, name))(inner[0]))
                case Angle():
                    y, x = inner
                    found = np.asarray(np.where((y == 0) & (x == 0), np.nan, np.arctan2(y, x)))
            known.append(found)
    return np.asarray(known[-1])
