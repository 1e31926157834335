"""Verify that a flat form is one of x⁺ = f(x, u): f(X(z), U(z)) = X(z one step later), as an identity.

The checker judges: it compares both sides by normal forms, so that the identity holds wherever all parts are defined.
For a state that is an angle, both sides have the same sine and cosine, and f turns with its angles by whole turns
(`checker.flatness` has the theorem and its proof). What it refuses is looked at in float64 here, to say where f and
the flat form differ.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from trackably.checker import flatness, formulas, subject
from trackably.systems.expressions import (
    Angle,
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
    all_nodes,
    evaluate_floats,
    operands,
    outline,
    substituted,
    variables,
)
from trackably.systems.flat_forms import FlatForm, one_step_later

_TRIALS, _SPREADS, _CLEARLY = 20, (0.3, 1.0, 3.0), 1e-6


# What must hold so that formulas have values: divisors are not zero, arguments of roots and logarithms positive.

MOST_MULTIPLIED = 64
"""Powers with whole exponents up to this size are repeated multiplication; others are exp(p log x), for x > 0."""

_NEEDS_POSITIVE = {"log", "sqrt"}


@dataclass(frozen=True)
class Requirement:
    """The `formula` is positive, or, if it may be negative too, only not zero."""

    formula: Expression
    may_be_negative: bool

    def __str__(self) -> str:
        return f"{outline(self.formula)} {'≠' if self.may_be_negative else '>'} 0"


def requirements(formulas: Iterable[Expression]) -> tuple[Requirement, ...]:
    """Return what these formulas need to be defined, once each; numbers that fulfil it are left out."""
    found: dict[Requirement, None] = {}
    for formula in formulas:
        for node in all_nodes(formula):
            needed = _needed(node)
            if needed is not None and not _is_fulfilled(needed):
                found[needed] = None
    return tuple(found)


def _needed(node: Expression) -> Requirement | None:
    match node:
        case Quotient(_, b):
            return Requirement(b, may_be_negative=True)
        case Function(name, argument) if name in _NEEDS_POSITIVE:
            return Requirement(argument, may_be_negative=False)
        case Power(base, exponent) if not exponent.is_integer() or abs(exponent) > MOST_MULTIPLIED:
            return Requirement(base, may_be_negative=False)
        case Power(base, exponent) if exponent < 0:
            return Requirement(base, may_be_negative=True)
        case Angle(y, x):
            return Requirement(Sum(Power(x, 2.0), Power(y, 2.0)), may_be_negative=False)
    return None


def _is_fulfilled(needed: Requirement) -> bool:
    number = needed.formula.value if isinstance(needed.formula, Constant) else 0.0
    return number > 0 or (needed.may_be_negative and number != 0)


def with_flat_form(f: Sequence[Expression], form: FlatForm, names: Sequence[str]) -> tuple[Expression, ...]:
    """Return f(X(z), U(z)): f with the formulas of states and inputs, whose `names` are in their order."""
    formulas = dict(zip(names, (*form.states, *form.inputs), strict=True))
    return tuple(substituted(formula, formulas) for formula in f)


def needs(f: Sequence[Expression], form: FlatForm, names: Sequence[str]) -> tuple[Requirement, ...]:
    """Return what must hold at a time t so that x(t), x(t + T), u(t) and f(x(t), u(t)) are defined, and so that the
    identity holds."""
    later = [one_step_later(formula) for formula in form.states]
    of_positive = (*form.positive, *(Function("log", p) for p in form.positive))
    return requirements((*form.states, *form.inputs, *later, *with_flat_form(f, form, names), *of_positive))


def why_not_flat(f: Sequence[Expression], form: FlatForm, states: Sequence[str], inputs: Sequence[str]) -> str | None:
    """Return why this is no flat form of f, or is not shown to be one; None if it is."""
    if (len(form.states), len(form.inputs)) != (len(states), len(inputs)):
        return (
            f"has formulas of {len(form.states)} states and {len(form.inputs)} inputs, but the system has "
            f"{len(states)} and {len(inputs)}"
        )
    if unknown := {*form.angles} - {*states}:
        return f"calls {min(unknown)} an angle, which is no state"
    own = _CheckersFormulas()
    flat = subject.FlatForm(own.all(form.states), own.all(form.inputs), form.angles, own.all(form.positive))
    system = subject.NonlinearSystem(own.all(f), tuple(states), tuple(inputs), 1.0, flat)
    for state, formula in zip(states, system.f, strict=True):
        for angle in form.angles:
            turned = flatness.turns(formula, angle)
            if turned is None or (turned and state not in form.angles):
                return f"calls {angle} an angle, but the formula of {state} changes if it is turned by 2π"
    why = flatness.why_not_flat(system, flat)
    if why is None:
        return None
    later = [one_step_later(formula) for formula in form.states]
    for state, a, b in zip(states, with_flat_form(f, form, (*states, *inputs)), later, strict=True):
        off: Expression = Difference(a, b)
        if state in form.angles:  # zero for whole turns
            off = Function("sin", Product(Constant(0.5), off))
        if found := _not_zero(off, form.positive):
            return f"is not one of f: one step later {state} is off{found}"
    return f"is not shown to be one of f: {why.removeprefix('flat: ')}"


class _CheckersFormulas:
    """Formulas as the checker has them; shared parts stay shared."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[Expression, formulas.Formula]] = {}

    def all(self, expressions: Iterable[Expression]) -> tuple[formulas.Formula, ...]:
        """Return all of these formulas."""
        return tuple(map(self._of, expressions))

    def _of(self, expression: Expression) -> formulas.Formula:
        for node in all_nodes(expression):
            if id(node) not in self._known:  # the node is kept, so that no other one gets its id
                inner = [self._known[id(operand)][1] for operand in operands(node)]
                self._known[id(node)] = node, self._made(node, inner)
        return self._known[id(expression)][1]

    def _made(self, node: Expression, inner: list[formulas.Formula]) -> formulas.Formula:
        match node:
            case Constant(value):
                return formulas.Number(value)
            case Variable(name):
                return formulas.Name(name)
            case Binary():
                return formulas.Operation(_SYMBOLS[type(node)], *inner)
            case Power(_, exponent):
                return formulas.Power(inner[0], exponent)
            case Function(name):
                return formulas.Function(name, inner[0])
            case Angle():
                return formulas.Angle(*inner)
        raise TypeError(f"not an expression: {node!r}")


_SYMBOLS: dict[type[Binary], formulas.Symbol] = {Sum: "+", Difference: "-", Product: "*", Quotient: "/"}


def _not_zero(error: Expression, positive: Sequence[Expression]) -> str | None:
    """Return where a formula is clearly not zero in float64; None where that is not seen."""
    names = sorted({name for formula in (error, *positive) for name in variables(formula)})
    rng = np.random.default_rng(0)
    for spread in np.repeat(_SPREADS, _TRIALS):
        at = {name: np.asarray(value) for name, value in zip(names, rng.normal(1.0, spread, len(names)), strict=True)}
        off = float(evaluate_floats(error, at))
        if not all(evaluate_floats(p, at) > 0 for p in positive):
            continue
        if np.isfinite(off) and abs(off) > _CLEARLY * (1 + max(map(abs, map(float, at.values())), default=0.0)):
            where = ", ".join(f"{name} = {float(value):.4g}" for name, value in at.items())
            return f" where {where}"
    return None
