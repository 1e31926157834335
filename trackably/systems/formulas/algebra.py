"""Sums, products and derivatives of expressions, without trivial terms and factors."""

from collections.abc import Callable

from trackably.systems.formulas.expression import (
    ONE,
    Angle,
    Constant,
    Difference,
    Expression,
    Function,
    Power,
    Product,
    Quotient,
    Sum,
    Variable,
    all_nodes,
)

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
