"""Verify that a flat form is one of x⁺ = f(x, u): f(X(z), U(z)) = X(z one step later), as an identity.

Both sides are compared by normal forms (`formulas.normal`): so the identity holds wherever all parts are defined. Most
states and inputs are not written out where the identity holds whatever their values are (`formulas.hiding`). For a
state that is an angle, both sides have the same sine and cosine; then f must turn with its angles: if a state in
`angles` is turned by 2π, f changes by whole turns of the angles, and by nothing else. So there are whole turns which,
added to the angles of X at each step, give states that f follows exactly.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from trackably.systems.flat.form import FlatForm, one_step_later
from trackably.systems.flat.requirements import Requirement, requirements
from trackably.systems.formulas.evaluation import evaluate_floats
from trackably.systems.formulas.expression import (
    Constant,
    Difference,
    Expression,
    Function,
    Product,
    Sum,
    Variable,
    operands,
    variables,
)
from trackably.systems.formulas.hiding import Shapes, hideable
from trackably.systems.formulas.normal import NormalForms
from trackably.systems.formulas.ratios import TooLongError
from trackably.systems.formulas.substitution import substituted

_TRIALS, _SPREADS, _CLEARLY = 20, (0.3, 1.0, 3.0), 1e-6


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
    for state, formula in zip(states, f, strict=True):
        for angle in form.angles:
            turned = turns(formula, angle)
            if turned is None or (turned and state not in form.angles):
                return f"calls {angle} an angle, but the formula of {state} changes if it is turned by 2π"
    later = [one_step_later(formula) for formula in form.states]
    reached = with_flat_form(f, form, (*states, *inputs))
    if (why := _unequal(form, later, reached, states)) is None:
        return None
    for state, a, b in zip(states, reached, later, strict=True):
        off: Expression = Difference(a, b)
        if state in form.angles:  # zero for whole turns
            off = Function("sin", Product(Constant(0.5), off))
        if found := _not_zero(off, form.positive):
            return f"is not one of f: one step later {state} is off{found}"
    return why


def turns(formula: Expression, angle: str) -> int | None:
    """Return n such that the formula changes by 2π n whenever the angle does by 2π; None where no n is seen."""
    inner = [turns(operand, angle) for operand in operands(formula)]
    found = None if any(n != 0 for n in inner) else 0
    match formula, inner:
        case Variable(name), _:
            found = int(name == angle)
        case Sum(), [int(a), int(b)]:
            found = a + b
        case Difference(), [int(a), int(b)]:
            found = a - b
        case Product(Constant(value), _), [_, int(b)] if value.is_integer():
            found = int(value) * b
        case Product(_, Constant(value)), [int(a), _] if value.is_integer():
            found = int(value) * a
        case Function("sin" | "cos"), [int()]:
            found = 0
    return found


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


def _unequal(
    form: FlatForm, later: Sequence[Expression], reached: Sequence[Expression], states: Sequence[str]
) -> str | None:
    """Return why the identity is not shown; None if it is."""
    try:
        whole: NormalForms | None = None
        for state, a, b in zip(states, reached, later, strict=True):
            if state not in form.angles and _equal_whatever_parts_are(form, later, a, b):
                continue
            whole = whole or _normal_forms(form, later)
            if not (whole.point_alike(a, b) if state in form.angles else whole.are_equal(a, b)):
                return f"is not shown to be one of f: {state} may differ from that one step later"
    except (TooLongError, ZeroDivisionError) as error:
        return f"is not shown to be one of f: {error}"
    return None


def _normal_forms(form: FlatForm, later: Sequence[Expression]) -> NormalForms:
    every = (*form.states, *later, *form.inputs)
    found = NormalForms(_names((*every, *form.positive)), form.positive)
    for formula in every:
        found.of(formula)  # their roots are known before products of them are met
    return found


def _equal_whatever_parts_are(form: FlatForm, later: Sequence[Expression], a: Expression, b: Expression) -> bool:
    """Whether a = b for all values of states and inputs but one, which is written out: as chains solve for them."""
    shapes = Shapes()
    hidden = hideable((*form.states, *form.inputs, *later), shapes)
    for shown in sorted(hideable((*form.states, *form.inputs), shapes)) or [-1]:
        p, q, *positive = (shapes.without(formula, hidden - {shown}) for formula in (a, b, *form.positive))
        try:
            if NormalForms(_names((p, q, *positive)), positive).are_equal(p, q):
                return True
        except (TooLongError, ZeroDivisionError):
            continue
    return False


def _names(formulas: Sequence[Expression]) -> Iterator[str]:
    yield from {name for formula in formulas for name in variables(formula)}
