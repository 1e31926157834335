"""Call a Python function with symbols, to get the formulas that it computes, and compare these with its numbers.

A function may treat symbols in another way than numbers (it asks for types, or catches what symbols raise), or each
call in another way (it draws numbers, or counts calls). So it is called twice with symbols, and then with numbers: what
is not the same formula, or has other values, is refused. Numbers are drawn, so that this is evidence, not a proof.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
from flint import arb, ctx

from trackably.arrays import Array
from trackably.systems.formulas.evaluation import evaluate, evaluate_floats
from trackably.systems.formulas.expression import Expression, Variable
from trackably.systems.formulas.hiding import Shapes
from trackably.systems.formulas.symbol import REFUSALS, SUPPORTED, Refusal, Symbol, as_expression

Dynamics = Callable[[Any, Any], Any]
"""f(x, u): the successor states, as a sequence, from the arrays of states and inputs."""

T = TypeVar("T")

_Sequence = (list, tuple, np.ndarray)
_SIZES, _DRAWS = np.logspace(-4, 6, 11), 6  # of each size, half of them positive: roots and logarithms need it
_FLOAT64 = 53
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

    Ball arithmetic in the precision of float64 says what operations may round. Where one of both values is not defined,
    numbers may be too large on the way: then nothing is said.
    """
    before, ctx.prec = ctx.prec, _FLOAT64
    try:
        ball = evaluate(formula, {name: arb(value) for name, value in values.items()}, _Balls())
    finally:
        ctx.prec = before
    if not ball.is_finite() or not np.isfinite(rounded):
        return ball.is_finite() or not np.isnan(rounded) or not np.isfinite(seen)
    return bool(abs(seen - rounded) <= _ROUNDING * (float(ball.rad()) + np.spacing(abs(rounded))))


class _Balls:
    """Balls that hold what rounding to float64 may do."""

    def constant(self, value: float) -> arb:
        return arb(value)

    def power(self, base: arb, exponent: float) -> arb:
        return base ** arb(exponent)

    def function(self, name: str, argument: arb) -> arb:
        found: arb = getattr(argument, name)()
        return found

    def angle(self, y: arb, x: arb) -> arb:
        return arb.atan2(y, x)


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
