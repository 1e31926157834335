"""Formulas in any arithmetic, part by part, for the tests' own arithmetics."""

from collections.abc import Mapping
from typing import Any

from trackably.checker.formulas import OPERATORS, Angle, Formula, Function, Name, Number, Operation, Power, parts


def evaluate(formula: Formula, values: Mapping[str, Any], arithmetic: Any) -> Any:
    """Return the value of a formula from the `values` of its names, by the operations of an `arithmetic`."""
    known: dict[Formula, Any] = {}
    for node in parts(formula):
        match node:
            case Number(value):
                known[node] = arithmetic.constant(value)
            case Name(name):
                known[node] = values[name]
            case Operation("/", left, right):
                known[node] = arithmetic.over(known[left], known[right])
            case Operation(symbol, left, right):
                known[node] = OPERATORS[symbol](known[left], known[right])
            case Power(base, exponent):
                known[node] = arithmetic.power(known[base], exponent)
            case Function(function, argument):
                known[node] = arithmetic.function(function, known[argument])
            case Angle(y, x):
                known[node] = arithmetic.angle(known[y], known[x])
    return known[formula]
