"""Call a Python function once with symbols, to get the formulas that it computes."""

from collections.abc import Callable
from typing import Any

import numpy as np

from trackable.systems.formulas.expression import Expression, Variable
from trackable.systems.formulas.symbol import SUPPORTED, NoFormulaError, Symbol, as_expression

Dynamics = Callable[[Any, Any], Any]
"""f(x, u): the successor states, as a sequence, from the arrays of states and inputs."""

_Sequence = (list, tuple, np.ndarray)


def traced(f: Dynamics, states: tuple[str, ...], inputs: tuple[str, ...]) -> tuple[Expression, ...]:
    """Return the formulas that f computes, one for each state. NoFormulaError: it computes none; says why."""
    x, u = (np.array([Symbol(Variable(name)) for name in names], dtype=object) for names in (states, inputs))
    values = _called(lambda: f(x, u), "system: f")
    if not isinstance(values, _Sequence) or len(values) != len(states):
        given = f"{len(values)} values" if isinstance(values, _Sequence) else type(values).__name__
        raise NoFormulaError(f"system: f must return a list of {len(states)} successors, got {given}")
    return tuple(_formula_of(value, "system: f") for value in values)


def formulas_of(call: Callable[[], Any], what: str) -> tuple[tuple[Expression, ...], tuple[Expression, ...]]:
    """Return the formulas of two lists that a call returns. NoFormulaError: it returns something else; says what."""
    values = _called(call, what)
    if not (isinstance(values, _Sequence) and len(values) == 2 and all(isinstance(v, _Sequence) for v in values)):
        raise NoFormulaError(f"{what}: must return a list of states and a list of inputs")
    states, inputs = (tuple(_formula_of(value, what) for value in part) for part in values)
    return states, inputs


def _called(call: Callable[[], Any], what: str) -> Any:
    try:
        return call()
    except NoFormulaError:
        raise
    except (TypeError, AttributeError, ValueError, ArithmeticError, IndexError) as error:
        raise NoFormulaError(f"{what} must be written in {SUPPORTED}: {error}") from error


def _formula_of(value: object, what: str) -> Expression:
    found = as_expression(value)
    if found is None:
        raise NoFormulaError(f"{what} must return numbers and formulas, got {type(value).__name__}")
    return found
