"""Call a Python function with symbols to get the formulas that it computes, and compare these with its numbers.

A function may treat symbols differently from numbers (it asks for types, or catches exceptions of symbols), or each
call differently (it draws numbers, or counts calls). So it is also called with numbers, and refused if its values are
not those of the formulas. The numbers are drawn at random: this is evidence, not a proof.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import Any, NoReturn

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from trackably.arrays import Array
from trackably.checker.formulas import Angle, Formula, Function, Name, Number, Operation, Power, text
from trackably.checker.intervals import ZERO, UndefinedError, exactly
from trackably.checker.inverse import is_number, times
from trackably.checker.models import constants
from trackably.checker.rounding import FormulaNeeds, FormulaValues
from trackably.systems.formulas import evaluate_floats, is_float64, plain_text

# Symbols: numbers that are not known yet; arithmetic with them records the formula.

SUPPORTED = (
    "+ - * / ** with numbers, and NumPy's exp, log, sqrt, sin, cos, tan, arctan, arctan2, hypot, sinh, cosh, tanh, abs"
)


_REASONS: ContextVar[list[str]] = ContextVar("_REASONS", default=[])  # noqa: B039  used while nothing is traced
"""Reasons why the traced function has no formula. They are stored, because the function may catch every exception."""


class Refusal(BaseException):
    """A computation that cannot be written as a formula.

    A BaseException, so that `except Exception` does not catch it.
    """


def refuse(why: str) -> NoReturn:
    """Store the reason, which begins with what the traced function must do or be, and stop it by raising Refusal."""
    _REASONS.get().append(said := f"must {why}")
    raise Refusal(said)


def as_formula(value: object) -> Formula:
    """Return the formula of a symbol or a number. TypeError: it is neither. Refusal: the number is not a float64."""
    if isinstance(value, np.ndarray | np.generic) and value.shape == ():
        value = value.item()
    if isinstance(value, Symbol):
        return value.formula
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise TypeError(f"expected numbers and formulas, got {type(value).__name__}")
    if not is_float64(value):
        refuse(f"use numbers that are finite, and exact in float64, got {value!r}")
    return Number(float(value))


def _refusal(what: str) -> Callable[..., Any]:
    return lambda *_: refuse(f"be one formula for all states and inputs, but {what}; use {SUPPORTED}")


class Symbol(NDArrayOperatorsMixin):
    """An unknown number: arithmetic with it returns a symbol of the resulting formula.

    By `NDArrayOperatorsMixin`, Python's operators call NumPy's functions, which call `__array_ufunc__`. For symbols in
    an array, NumPy calls operators and methods such as `sin` instead.
    """

    def __init__(self, formula: Formula) -> None:
        self.formula = formula

    def __repr__(self) -> str:
        return plain_text(self.formula)

    def __getattr__(self, name: str) -> Any:
        if name in _WRITTEN:
            return lambda *others: getattr(np, name)(self, *others)
        raise AttributeError(f"the symbol of a state or an input has no attribute {name}; use {SUPPORTED}")

    __hash__ = _refusal("it uses a value as a key of a dictionary or set")
    __bool__ = _refusal("it branches on a value")
    __round__ = __trunc__ = __floor__ = __ceil__ = _refusal("it rounds a value, which has jumps")
    __float__ = __int__ = __index__ = __complex__ = _refusal(
        "it converts a value to a plain number, as float() and Python's math do (use np.sin instead of math.sin)"
    )

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *given: object, **options: object) -> Any:
        name = ufunc.__name__
        if method == "__call__" and not options:
            if any(isinstance(value, np.ndarray) and value.shape for value in given):
                return ufunc(*(_as_objects(value) for value in given))
            if name in _REFUSED:
                _refusal(_REFUSED[name])()
            if name in _WRITTEN:
                return Symbol(_WRITTEN[name](*map(as_formula, given)))
        refuse(f"be written in {SUPPORTED}; it uses np.{name}")


_COMPARED, _REMAINDER = "it compares a value", "it takes a remainder, which has jumps"
_REFUSED = dict.fromkeys(["less", "less_equal", "greater", "greater_equal", "equal", "not_equal"], _COMPARED)
_REFUSED |= dict.fromkeys(["remainder", "floor_divide", "divmod"], _REMAINDER)


def _sum(a: Formula, b: Formula) -> Formula:
    """Return the formula a + b, without terms that are zero, because Python's `sum` starts from zero."""
    return b if is_number(a, 0.0) else a if is_number(b, 0.0) else Operation("+", a, b)


def _difference(a: Formula, b: Formula) -> Formula:
    return a if is_number(b, 0.0) else Operation("-", a, b)


def _product(a: Formula, b: Formula) -> Formula:
    """Return the formula a b; if a and b are the same formula, its square, whose range is known not to be negative."""
    found = Power(a, 2.0) if a is b else times(a, b)
    assert found is not None
    return found


def _power(a: Formula, b: Formula) -> Formula:
    if isinstance(b, Number):
        return a if b.value == 1.0 else Function("sqrt", a) if b.value == 0.5 else Power(a, b.value)
    if isinstance(a, Number) and a.value > 0 and math.isfinite(a.value):
        return Function("exp", Operation("*", b, Function("log", a)))
    refuse(f"have numbers as exponents, or positive numbers as bases, got {text(a)}**{text(b)}")


def _by(compute: Callable[..., Any]) -> Callable[..., Formula]:
    """Return a function of formulas that calls `compute` with their symbols, and returns the formula of the result."""
    return lambda *formulas: compute(*map(Symbol, formulas)).formula


_length = _by(lambda *parts: np.sqrt(sum(map(np.square, parts))))
"""√(a² + b²) for np.hypot, and √(a²) for np.abs. As a formula with derivatives it is undefined at zero."""


_WRITTEN: dict[str, Callable[..., Formula]] = {
    "add": _sum,
    "subtract": _difference,
    "multiply": _product,
    "divide": lambda a, b: Operation("/", a, b),
    "power": _power,
    "float_power": _power,
    "negative": _by(lambda a: -1.0 * a),
    "positive": lambda a: a,
    "square": lambda a: Power(a, 2.0),
    "reciprocal": _by(lambda a: 1.0 / a),
    "absolute": _length,
    "fabs": _length,
    "hypot": _length,
    "arctan2": Angle,
    "arctan": partial(Function, "atan"),
    "tan": _by(lambda a: np.sin(a) / np.cos(a)),
    "sinh": _by(lambda a: (np.exp(a) - np.exp(-a)) / 2.0),
    "cosh": _by(lambda a: (np.exp(a) + np.exp(-a)) / 2.0),
    "tanh": _by(lambda a: 1.0 - 2.0 / (np.exp(2.0 * a) + 1.0)),
    **{name: partial(Function, name) for name in ("exp", "log", "sqrt", "sin", "cos")},
}
"""NumPy's functions as formulas."""


def _as_objects(value: object) -> np.ndarray:
    if isinstance(value, np.ndarray):
        return value.astype(object)
    scalar = np.empty((), dtype=object)
    scalar[()] = value
    return scalar


Dynamics = Callable[[Any, Any], Any]
"""A function f(x, u) of the arrays of states and inputs that returns the states of the next step as a sequence."""

_Sequence = (list, tuple, np.ndarray)
_SIZES, _DRAWS = np.logspace(-4, 6, 11), 6  # sizes of drawn numbers; draws of each size, half of them positive
_ROUNDING = 1e3  # f may differ from its formula by this multiple of the rounding error's bound: it may add in any order
_LINALG = (
    "np.linalg takes plain numbers only; write the inverse as a formula, for [[a, b], [c, d]] "
    "np.array([[d, -b], [-c, a]]) / (a * d - b * c)"
)


def trace(f: Dynamics, states: tuple[str, ...], inputs: tuple[str, ...]) -> tuple[Formula, ...]:
    """Return the formulas that f computes, one for each state. ValueError: f has no formulas; the message says why."""
    with _symbols_in("system: f"):
        values = f(*(np.array([Symbol(Name(name)) for name in names], dtype=object) for names in (states, inputs)))
        if not isinstance(values, _Sequence) or len(values) != len(states):
            given = f"{len(values)} values" if isinstance(values, _Sequence) else type(values).__name__
            refuse(f"return a list of {len(states)} successors, got {given}")
        return tuple(map(as_formula, values))


def require_same_values(
    f: Dynamics, formulas: Sequence[Formula], states: tuple[str, ...], inputs: tuple[str, ...]
) -> None:
    """Compare f with its formulas at drawn numbers. ValueError: they differ, or f raises where they are defined."""
    rng, n = np.random.default_rng(0), len(states)
    drawn = np.concatenate([size * rng.normal(size=(_DRAWS, n + len(inputs))) for size in _SIZES])
    drawn[::2] = abs(drawn[::2])
    columns = dict(zip((*states, *inputs), drawn.T, strict=True))
    rounded = [np.broadcast_to(evaluate_floats(of, columns), len(drawn)) for of in formulas]
    for at, *expected in zip(drawn, *rounded, strict=True):
        (seen, said), values = _values_of(f, *np.split(at.copy(), [n])), dict(zip(columns, at.tolist(), strict=True))
        for state, formula, number, value in zip(states, formulas, seen.tolist(), map(float, expected), strict=True):
            if not _agree(formula, values, number, value):
                where = ", ".join(f"{name} = {of:.6g}" for name, of in values.items())
                raise ValueError(
                    f"system: f must be one formula for all states, inputs and calls, but at {where} it "
                    f"{said or f'gives {state} = {number!r}'}, and its formula gives {state} = {value!r}; use "
                    f"{SUPPORTED}"
                )


def _values_of(f: Dynamics, x: Array, u: Array) -> tuple[Array, str]:
    """Return the values of f at numbers and an empty text; if f raises or returns another shape, NaN and a message."""
    try:
        with np.errstate(all="ignore"):
            found = np.asarray(f(x, u), dtype=float)
    except (Exception, Refusal) as error:  # f is the user's function, and may raise anything
        return np.full(len(x), np.nan), f"raises {type(error).__name__} ({error})"
    return (found, "") if found.shape == x.shape else (np.full(len(x), np.nan), f"gives the shape {found.shape}")


def _agree(formula: Formula, values: dict[str, float], seen: float, rounded: float) -> bool:
    """Return whether `seen` may be the value of the formula, where `rounded` is this value in float64.

    The checker's analysis bounds rounding errors. If it finds no bound, or `rounded` is not finite, the values count as
    equal, because intermediate numbers may be too large. The one exception: without a bound, a finite `seen` does not
    agree with NaN.
    """
    if seen == rounded:
        return True
    error = _rounding_error(formula, values)
    if not np.isfinite(error) or not np.isfinite(rounded):
        return bool(np.isfinite(error)) or not np.isnan(rounded) or not np.isfinite(seen)
    return bool(abs(seen - rounded) <= _ROUNDING * (error + np.spacing(abs(rounded))))


def _rounding_error(formula: Formula, values: dict[str, float]) -> float:
    """Return an over-estimate of the error of the formula in float64; infinite if it may be undefined."""
    exact, without_errors = {name: exactly(value) for name, value in values.items()}, dict.fromkeys(values, ZERO)
    try:
        _, error = FormulaValues(FormulaNeeds({}, without_errors, 0), 1).track(formula, constants(exact, 1))
    except UndefinedError:
        return np.inf
    return float(error.b)


def formulas_of(call: Callable[[], Any]) -> tuple[tuple[Formula, ...], tuple[Formula, ...]]:
    """Call a function of a flat form with symbols, and return the formulas of its states and of its inputs.

    ValueError: it does not return a list of states and a list of inputs; the message says what it returns.
    """
    with _symbols_in("flat form"):
        values = call()
        if not (isinstance(values, _Sequence) and len(values) == 2 and all(isinstance(v, _Sequence) for v in values)):
            refuse("return a list of states and a list of inputs")
        states, inputs = (tuple(map(as_formula, part)) for part in values)
        return states, inputs


@contextmanager
def _symbols_in(what: str) -> Iterator[None]:
    """Raise ValueError, which begins with `what`, if a function called with symbols raises, or has no formula."""
    reasons: list[str] = []
    token = _REASONS.set(reasons)
    try:
        yield
    except Refusal as error:  # if raised in another thread, its reason is not in `reasons` yet
        reasons.append(str(error))
    except (TypeError, AttributeError, ValueError, ArithmeticError, IndexError) as error:
        instead = f"; {_LINALG}" if "dtype('O')" in str(error) else ""
        said = f"raises {type(error).__name__} ({error}) for arrays of symbols"
        reasons.append(f"{said}; it must be written in {SUPPORTED}{instead}")
    finally:
        _REASONS.reset(token)
    if reasons:
        raise ValueError(f"{what} {reasons[0]}")
