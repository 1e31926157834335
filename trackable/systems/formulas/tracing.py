"""Call a Python function once with symbols, to get the formulas that it computes."""

from collections.abc import Callable
from typing import Any

import numpy as np

from trackable.systems.formulas.expression import Expression, Variable
from trackable.systems.formulas.symbol import SUPPORTED, NoFormulaError, Symbol, as_expression

Dynamics = Callable[[Any, Any], Any]
"""f(x, u): the successor states, as a sequence, from the arrays of states and inputs."""


def traced(f: Dynamics, states: tuple[str, ...], inputs: tuple[str, ...]) -> tuple[Expression, ...]:
    """Return the formulas that f computes, one for each state. NoFormulaError: it computes none; says why."""
    x, u = (np.array([Symbol(Variable(name)) for name in names], dtype=object) for names in (states, inputs))
    try:
        values = f(x, u)
    except NoFormulaError:
        raise
    except (TypeError, AttributeError, ValueError, ArithmeticError) as error:
        raise NoFormulaError(f"system: f must be written in {SUPPORTED}: {error}") from error
    if not isinstance(values, list | tuple | np.ndarray) or len(values) != len(states):
        given = f"{len(values)} values" if isinstance(values, list | tuple | np.ndarray) else type(values).__name__
        raise NoFormulaError(f"system: f must return a list of {len(states)} successors, got {given}")
    return tuple(_formula_of(value) for value in values)


def _formula_of(value: object) -> Expression:
    found = as_expression(value)
    if found is None:
        raise NoFormulaError(f"system: f must return numbers and formulas, got {type(value).__name__}")
    return found
