"""Symbols: numbers that are not known yet; arithmetic with them records the formula."""

import math
import operator
from collections.abc import Callable
from contextvars import ContextVar
from typing import Any, NoReturn

import numpy as np

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
    is_float64,
)

SUPPORTED = (
    "+ - * / ** with numbers, and NumPy's exp, log, sqrt, sin, cos, tan, arctan, arctan2, hypot, sinh, cosh, tanh, abs"
)


REFUSALS: ContextVar[list[str]] = ContextVar("REFUSALS", default=[])  # noqa: B039  of whoever traces nothing
"""Why the function that is traced has no formula: kept, as it may catch whatever is raised."""


class Refusal(BaseException):
    """A computation that cannot be written as a formula: no `except Exception` of a traced function catches it."""


def refuse(why: str) -> NoReturn:
    """End what is traced. Refusal: it is also kept in `REFUSALS`."""
    said = f"system: f must {why}"
    REFUSALS.get().append(said)
    raise Refusal(said)


def as_expression(value: object) -> Expression | None:
    """Return the expression of a symbol or a number; None for anything else. Refusal: not a float64."""
    if isinstance(value, Symbol):
        return value.expression
    if isinstance(value, np.ndarray) and value.shape == ():
        return as_expression(value.item())
    if isinstance(value, np.generic):
        value = value.item()
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    if not is_float64(value):
        refuse(f"use numbers that are finite, and exact in float64, got {value!r}")
    return Constant(float(value))


def _refused(what: str) -> Callable[..., Any]:
    return lambda *_: refuse(f"be one formula for all states and inputs, but {what}; use {SUPPORTED}")


class Symbol:
    """A number that is not known yet: arithmetic with it gives a symbol of the resulting formula."""

    def __init__(self, expression: Expression) -> None:
        self.expression = expression

    def __repr__(self) -> str:
        return str(self.expression)

    def __add__(self, other: object) -> Any:
        return _binary(_sum, self, other)

    def __radd__(self, other: object) -> Any:
        return _binary(_sum, other, self)

    def __sub__(self, other: object) -> Any:
        return _binary(_difference, self, other)

    def __rsub__(self, other: object) -> Any:
        return _binary(_difference, other, self)

    def __mul__(self, other: object) -> Any:
        return _binary(_product, self, other)

    def __rmul__(self, other: object) -> Any:
        return _binary(_product, other, self)

    def __truediv__(self, other: object) -> Any:
        return _binary(Quotient, self, other)

    def __rtruediv__(self, other: object) -> Any:
        return _binary(Quotient, other, self)

    def __pow__(self, other: object) -> Any:
        return _binary(_power, self, other)

    def __rpow__(self, other: object) -> Any:
        return _binary(_power, other, self)

    def __neg__(self) -> "Symbol":
        return -1.0 * self  # type: ignore[no-any-return]

    def __pos__(self) -> "Symbol":
        return self

    def exp(self) -> "Symbol":
        return Symbol(Function("exp", self.expression))

    def log(self) -> "Symbol":
        return Symbol(Function("log", self.expression))

    def sqrt(self) -> "Symbol":
        return Symbol(Function("sqrt", self.expression))

    def sin(self) -> "Symbol":
        return Symbol(Function("sin", self.expression))

    def cos(self) -> "Symbol":
        return Symbol(Function("cos", self.expression))

    def arctan(self) -> "Symbol":
        return Symbol(Function("atan", self.expression))

    def arctan2(self, x: object) -> Any:
        return _binary(Angle, self, x)

    def hypot(self, other: object) -> Any:
        return _binary(_hypotenuse, self, other)

    def __abs__(self) -> "Symbol":
        """Return √(x²), which is defined, as a formula with derivatives, away from zero only."""
        return Symbol(Function("sqrt", Power(self.expression, 2.0)))

    def tan(self) -> Any:
        return self.sin() / self.cos()

    def sinh(self) -> Any:
        return (self.exp() - (-self).exp()) / 2

    def cosh(self) -> Any:
        return (self.exp() + (-self).exp()) / 2

    def tanh(self) -> Any:
        return 1 - 2 / ((2 * self).exp() + 1)

    __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = _refused("it compares a value")
    __hash__ = _refused("it looks a value up")
    __bool__ = _refused("it branches on a value")
    __mod__ = __rmod__ = __floordiv__ = __rfloordiv__ = __divmod__ = _refused("it takes a remainder, which has jumps")
    __round__ = __trunc__ = __floor__ = __ceil__ = _refused("it rounds a value, which has jumps")
    __float__ = __int__ = __index__ = __complex__ = _refused(
        "it makes a plain number of a value, as float() and Python's math do (np.sin is for math.sin, and so on)"
    )

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *given: object, **options: object) -> Any:
        if method == "__call__" and not options:
            if any(isinstance(value, np.ndarray) for value in given):
                return ufunc(*(_as_objects(value) for value in given))
            name = ufunc.__name__
            if name in _OPERATORS:
                # A NumPy scalar's own operator would call this method again.
                return _OPERATORS[name](*(v.item() if isinstance(v, np.generic) else v for v in given))
            if name in _TWO_ARGUMENTS:
                return _binary(_TWO_ARGUMENTS[name], *given)
            if len(given) == 1 and name in _METHODS:
                return getattr(self, name)()
        refuse(f"be written in {SUPPORTED}; it uses np.{ufunc.__name__}")


def _hypotenuse(a: Expression, b: Expression) -> Expression:
    return Function("sqrt", Sum(Power(a, 2.0), Power(b, 2.0)))


_METHODS = {"exp", "log", "sqrt", "sin", "cos", "tan", "arctan", "sinh", "cosh", "tanh"}
_TWO_ARGUMENTS: dict[str, Callable[[Expression, Expression], Expression]] = {
    "arctan2": Angle,
    "hypot": _hypotenuse,
}
_OPERATORS: dict[str, Callable[..., Any]] = {
    "add": operator.add,
    "subtract": operator.sub,
    "multiply": operator.mul,
    "divide": operator.truediv,
    "power": operator.pow,
    "float_power": operator.pow,
    "negative": operator.neg,
    "positive": operator.pos,
    "square": lambda value: value**2,
    "reciprocal": lambda value: 1 / value,
    "absolute": abs,
    "fabs": abs,
}


def _as_objects(value: object) -> np.ndarray:
    if isinstance(value, np.ndarray):
        return value.astype(object)
    scalar = np.empty((), dtype=object)
    scalar[()] = value
    return scalar


def _binary(make: Callable[[Expression, Expression], Expression], left: object, right: object) -> Any:
    a, b = as_expression(left), as_expression(right)
    return NotImplemented if a is None or b is None else Symbol(make(a, b))


def _sum(a: Expression, b: Expression) -> Expression:
    """Return a + b without zero terms: Python's `sum` starts from zero."""
    return b if a == Constant(0.0) else a if b == Constant(0.0) else Sum(a, b)


def _difference(a: Expression, b: Expression) -> Expression:
    return a if b == Constant(0.0) else Difference(a, b)


def _product(a: Expression, b: Expression) -> Expression:
    return b if a == ONE else a if b == ONE else Product(a, b)


def _power(a: Expression, b: Expression) -> Expression:
    if isinstance(b, Constant):
        return a if b == ONE else Power(a, b.value)
    if isinstance(a, Constant) and a.value > 0 and math.isfinite(a.value):
        return Function("exp", Product(b, Function("log", a)))
    refuse(f"have numbers for exponents, or for positive bases, got ({a})**({b})")
