"""Call a Python function with symbols, to get the formulas that it computes, and compare these with its numbers.

A function may treat symbols in another way than numbers (it asks for types, or catches what symbols raise), or each
call in another way (it draws numbers, or counts calls). So it is called twice with symbols, and then with numbers: what
is not the same formula, or has other values, is refused. Numbers are drawn, so that this is evidence, not a proof.
"""

import math
import operator
from collections.abc import Callable, Sequence
from contextvars import ContextVar
from typing import Any, NoReturn, TypeVar

import numpy as np
from mpmath.ctx_iv import MPIntervalContext

from trackably.arrays import Array
from trackably.systems.expressions import (
    ONE,
    Angle,
    Constant,
    Difference,
    Expression,
    Function,
    Power,
    Product,
    Quotient,
    Shapes,
    Sum,
    Variable,
    evaluate,
    evaluate_floats,
    is_float64,
)

# Symbols: numbers that are not known yet; arithmetic with them records the formula.

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


Dynamics = Callable[[Any, Any], Any]
"""f(x, u): the successor states, as a sequence, from the arrays of states and inputs."""

T = TypeVar("T")

_Sequence = (list, tuple, np.ndarray)
_SIZES, _DRAWS = np.logspace(-4, 6, 11), 6  # of each size, half of them positive: roots and logarithms need it
_IV = MPIntervalContext()
_IV.prec = 53  # as float64 has
_ROUNDING = 1e3  # times what the formula's operations may round: f may add in another order
_LINALG = (
    "np.linalg takes plain numbers only: write the inverse out, which of [[a, b], [c, d]] is "
    "np.array([[d, -b], [-c, a]]) / (a * d - b * c)"
)


class NoFormulaError(ValueError):
    """A computation that cannot be written as a formula; the message says why."""


def traced(f: Dynamics, states: tuple[str, ...], inputs: tuple[str, ...]) -> tuple[Expression, ...]:
    """Return the formulas that f computes, one for each state. NoFormulaError: it computes none; says why."""
    one, other = (_formulas(f, states, inputs) for _ in range(2))
    shapes = Shapes()
    if any(shapes.of(a) != shapes.of(b) for a, b in zip(one, other, strict=True)):
        raise NoFormulaError(
            "system: f must be the same formula in each call, but was another one in the second; it may draw numbers, "
            "count, or change what it uses"
        )
    return one


def require_same_values(
    f: Dynamics, formulas: Sequence[Expression], states: tuple[str, ...], inputs: tuple[str, ...]
) -> None:
    """Compare f with its formulas at drawn numbers. NoFormulaError: it has other values, or is not defined there."""
    rng, n = np.random.default_rng(0), len(states)
    drawn = np.concatenate([size * rng.normal(size=(_DRAWS, n + len(inputs))) for size in _SIZES])
    drawn[::2] = abs(drawn[::2])
    names = (*states, *inputs)
    columns = [evaluate_floats(of, dict(zip(names, drawn.T, strict=True))) for of in formulas]
    rounded = np.stack([np.broadcast_to(column, len(drawn)) for column in columns], axis=-1)
    for at, expected in zip(drawn, rounded, strict=True):
        seen, said = _seen(f, *np.split(at.copy(), [n]))
        for state, formula, number, value in zip(states, formulas, seen.tolist(), expected.tolist(), strict=True):
            if not _agree(formula, dict(zip(names, at.tolist(), strict=True)), number, value):
                where = ", ".join(f"{name} = {of:.6g}" for name, of in zip(names, at.tolist(), strict=True))
                raise NoFormulaError(
                    f"system: f must be one formula for all states and inputs, but at {where} it "
                    f"{said or f'gives {state} = {number:.6g}'}, and its formula {state} = {value:.6g}; use {SUPPORTED}"
                )


def _seen(f: Dynamics, x: Array, u: Array) -> tuple[Array, str]:
    """Return what f gives for numbers, NaN where it raises; and what it raises."""
    try:
        with np.errstate(all="ignore"):
            found = np.asarray(f(x, u), dtype=float)
    except (Exception, Refusal) as error:  # f is anybody's, and may have kept a symbol
        return np.full(len(x), np.nan), f"raises {type(error).__name__} ({error})"
    return (found, "") if found.shape == x.shape else (np.full(len(x), np.nan), f"gives the shape {found.shape}")


def _agree(formula: Expression, values: dict[str, float], seen: float, rounded: float) -> bool:
    """Return whether a number may be that of the formula, of which `rounded` is the value in float64.

    Intervals in the precision of float64 say what operations may round. Where one of both values is not defined,
    numbers may be too large on the way: then nothing is said.
    """
    width = _rounding_width(formula, values)
    if not np.isfinite(width) or not np.isfinite(rounded):
        return bool(np.isfinite(width)) or not np.isnan(rounded) or not np.isfinite(seen)
    return bool(abs(seen - rounded) <= _ROUNDING * (width / 2 + np.spacing(abs(rounded))))


def _rounding_width(formula: Expression, values: dict[str, float]) -> float:
    """Return the width of what rounding to float64 may make of the value; infinite where there may be none."""
    try:
        found = evaluate(formula, {name: _IV.mpf(value) for name, value in values.items()}, _Intervals())
        return float(found.delta.b)
    except (ArithmeticError, ValueError, TypeError, AttributeError):  # mpmath has complex values, or none
        return float("inf")


class _Intervals:
    """Intervals that hold what rounding to float64 may do."""

    def constant(self, value: float) -> Any:
        return _IV.mpf(value)

    def power(self, base: Any, exponent: float) -> Any:
        return base ** (int(exponent) if exponent == int(exponent) else _IV.mpf(exponent))

    def function(self, name: str, argument: Any) -> Any:
        return _IV.atan2(argument, 1) if name == "atan" else getattr(_IV, name)(argument)

    def angle(self, y: Any, x: Any) -> Any:
        return _IV.atan2(y, x)


def formulas_of(call: Callable[[], Any], what: str) -> tuple[tuple[Expression, ...], tuple[Expression, ...]]:
    """Return the formulas of two lists that a call returns. NoFormulaError: it returns something else; says what."""

    def both() -> tuple[tuple[Expression, ...], tuple[Expression, ...]]:
        values = call()
        if not (isinstance(values, _Sequence) and len(values) == 2 and all(isinstance(v, _Sequence) for v in values)):
            raise NoFormulaError(f"{what}: must return a list of states and a list of inputs")
        states, inputs = (tuple(_formula_of(value, what) for value in part) for part in values)
        return states, inputs

    return _called(both, what)


def _formulas(f: Dynamics, states: tuple[str, ...], inputs: tuple[str, ...]) -> tuple[Expression, ...]:
    def formulas() -> tuple[Expression, ...]:
        values = f(*(np.array([Symbol(Variable(name)) for name in names], dtype=object) for names in (states, inputs)))
        if not isinstance(values, _Sequence) or len(values) != len(states):
            given = f"{len(values)} values" if isinstance(values, _Sequence) else type(values).__name__
            raise NoFormulaError(f"system: f must return a list of {len(states)} successors, got {given}")
        return tuple(_formula_of(value, "system: f") for value in values)

    return _called(formulas, "system: f")


def _called(call: Callable[[], T], what: str) -> T:
    """Return what a call with symbols returns. NoFormulaError: it raises, or does what symbols refuse."""
    refused: list[str] = []
    token = REFUSALS.set(refused)
    try:
        found = call()
    except (Refusal, NoFormulaError) as error:
        refused.append(str(error))
    except (TypeError, AttributeError, ValueError, ArithmeticError, IndexError) as error:
        instead = f"; {_LINALG}" if "dtype('O')" in str(error) else ""
        refused.append(f"{what} must be written in {SUPPORTED}: {error}{instead}")
    finally:
        REFUSALS.reset(token)
    if refused:
        raise NoFormulaError(refused[0])
    return found


def _formula_of(value: object, what: str) -> Expression:
    found = as_expression(value)
    if found is None:
        raise NoFormulaError(f"{what} must return numbers and formulas, got {type(value).__name__}")
    return found
