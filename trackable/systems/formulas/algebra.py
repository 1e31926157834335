"""Expressions made of expressions: sums and products without their trivial parts, derivatives, nested lists."""

import sys
from collections.abc import Callable
from reprlib import repr as short

from trackable.systems.formulas.expression import (
    BINARY,
    FUNCTIONS,
    ONE,
    Binary,
    Constant,
    Difference,
    Expression,
    Function,
    Power,
    Product,
    Quotient,
    Sum,
    Variable,
    parts,
)

Maybe = Expression | None
"""None is zero: a term or a factor that is not there."""

DEEPEST = 100
"""How deeply a formula may be nested."""

_KINDS = {kind.symbol: kind for kind in BINARY}
_MINUS_ONE = Constant(-1.0)


def plus(a: Maybe, b: Maybe) -> Maybe:
    """a + b."""
    if a is None or b is None:
        return b if a is None else a
    return Sum(a, b)


def minus(a: Maybe, b: Maybe) -> Maybe:
    """a − b."""
    if b is None:
        return a
    return Product(_MINUS_ONE, b) if a is None else Difference(a, b)


def times(a: Maybe, b: Maybe) -> Maybe:
    """a · b."""
    if a is None or b is None:
        return None
    if ONE in (a, b):
        return b if a == ONE else a
    return Product(a, b)


def over(a: Maybe, b: Expression) -> Maybe:
    """a / b."""
    return None if a is None else Quotient(a, b)


def derivative(expression: Expression, *names: str) -> Maybe:
    """∂/∂x, exactly, if all variables of these `names` are x plus something constant; None where that is zero."""
    known: dict[int, Maybe] = {}
    for node in parts(expression):
        known[id(node)] = _slope(node, names, lambda operand: known[id(operand)])
    return known[id(expression)]


def _slope(node: Expression, names: tuple[str, ...], of: Callable[[Expression], Maybe]) -> Maybe:
    slope: Maybe = None
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
    return slope


_FUNCTION_SLOPES: dict[str, Callable[[Expression, Expression, Expression], Maybe]] = {
    "exp": lambda node, argument, inner: times(node, inner),
    "log": lambda node, argument, inner: Quotient(inner, argument),
    "sqrt": lambda node, argument, inner: Quotient(inner, Product(Constant(2.0), node)),
    "sin": lambda node, argument, inner: times(Function("cos", argument), inner),
    "cos": lambda node, argument, inner: times(Product(_MINUS_ONE, Function("sin", argument)), inner),
}


def _power_slope(node: Expression, base: Expression, exponent: float) -> Maybe:
    """p base^(p − 1), where p − 1 need not be a float64: then p base^p / base."""
    if not exponent.is_integer():
        return Quotient(Product(Constant(exponent), node), base)
    lower = {0.0: None, 1.0: ONE, 2.0: base}.get(exponent, Power(base, exponent - 1))
    return times(Constant(exponent), lower)


def to_lists(expression: Expression) -> object:
    """As JSON: a number, a name, or a list of what is done and to what: ["+", …, …], ["^", …, 0.5], ["sqrt", …]."""
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
    raise TypeError(f"no expression: {expression!r}")


def from_lists(data: object, deepest: int = DEEPEST) -> Expression:
    """The inverse of `to_lists`; ValueError where `data` is nothing that it returns, or nested more deeply."""
    if deepest < 1:
        raise ValueError(f"a formula must not be nested more than {DEEPEST} deep")
    match data:
        case int() | float() if is_number(data):
            return Constant(float(data))
        case str():
            return Variable(data)
        case ["^", base, int() | float() as exponent] if is_number(exponent):
            return Power(from_lists(base, deepest - 1), float(exponent))
        case [str(name), argument] if name in FUNCTIONS:
            return Function(name, from_lists(argument, deepest - 1))
        case [str(symbol), left, right] if symbol in _KINDS:
            return _KINDS[symbol](from_lists(left, deepest - 1), from_lists(right, deepest - 1))
    raise ValueError(f"a formula must be a number, a name or a list that begins with what is done, got {short(data)}")


def is_number(value: object) -> bool:
    """Whether it is a number that float64 holds exactly."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max and float(value) == value
