"""Expressions as nested lists, the form in which JSON stores them."""

from reprlib import repr as short

from trackably.systems.formulas.expression import (
    BINARY,
    FUNCTIONS,
    Angle,
    Binary,
    Constant,
    Expression,
    Function,
    Power,
    Variable,
    is_float64,
)

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
