"""Flat forms, an extension: nonlinear systems whose states and inputs are formulas of shifted signals.

Theorem. A nonlinear system x⁺ = f(x, u) may come with formulas X and U of shifted signals, and a list of states that
are angles. Let x(t) = X(z(t), z(t + T), …) and u(t) = U(z(t), z(t + T), …). If `check` answers Proved, both are
defined, keep their bounds, and obey x(t + T) = f(x(t), u(t)), at the claimed times. With angles, x(t + T) and f(x(t),
u(t)) may differ by multiples of 2π in states that are angles, and f changes by such multiples if they do; so there
are multiples of 2π which, added to the angles in x(k T), give states that the system follows exactly, with the same
u(k T). Bounds of an angle are those of x(t) as X gives it.

Proof. f(X, U) and X with every signal one step later are written as quotients of polynomials in the signals and in
values of functions, by true equalities such as √a² = a and cos(atan2(y, x)) = x/√(x² + y²). Both sides are shown to be
the same quotients, and so are equal wherever all their parts are defined and the formulas in `positive` are positive
(`identities`). For states that are angles, sines and cosines of both sides are compared. If a state that is an angle
changes by 2π, f changes by whole multiples of 2π in states that are angles, and not at all in others; the sums,
products with whole numbers, sines and cosines in f show this (`turns`). Divisors, lengths of vectors whose angle is
taken, and arguments of log, sqrt and fractional powers, in X, U, f(X, U) and X one step later, are shown to be as
needed for all parts to be defined (`needs`, `rounding`), in the boxes of the last bound, which cover the same times as
all others, and in the tail (all times after the boxes). Rounding errors are propagated in each box, from the values
that the signals have there.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from trackably.checker.answers import FailedStepError
from trackably.checker.formulas import (
    Angle,
    Formula,
    Function,
    Name,
    Number,
    Operation,
    Power,
    names,
    operands,
    parts,
    rewritten,
    shared_parts,
)
from trackably.checker.identities import Quotient, TooLongError, Values
from trackably.checker.intervals import is_multiplied
from trackably.checker.subject import FlatForm, NonlinearSystem, indices, shifted_name


def substitute(formulas: Sequence[Formula], by: Mapping[Any, Formula]) -> list[Formula]:
    """Return the formulas, in which by[name] takes the place of a name, and by[part] that of any other part."""
    return rewritten(formulas, lambda node, _: by.get(node.name if isinstance(node, Name) else node))


@dataclass(frozen=True)
class Need:
    """A formula that must be positive, or only different from zero if it `may_be_negative`."""

    formula: Formula
    may_be_negative: bool


def check_flat_form(system: NonlinearSystem, flat: FlatForm) -> None:
    """Raise FailedStepError unless x(t + T) = f(x(t), u(t)) is shown for the formulas of a flat form.

    For states that are angles, both sides may differ by multiples of 2π.
    """
    for state, formula in zip(system.states, system.f, strict=True):
        for angle in flat.angles:
            turned = turns(formula, angle)
            if turned is None or (turned and state not in flat.angles):
                raise FailedStepError(
                    f"flat: if the angle {angle} turns by 2π, {state} may change by more than whole turns of angles; "
                    "use this angle in sin and cos only, or in sums of angles"
                )
    later, reached = one_step_later(flat.states), successor_formulas(system, flat)
    try:
        whole: Values | None = None
        for state, a, b in zip(system.states, reached, later, strict=True):
            if state not in flat.angles and _equal_whatever_parts_are(flat, later, a, b):
                continue
            whole = whole or _values(flat, later)
            if not _agree(whole, whole.of(a), whole.of(b), state in flat.angles):
                raise FailedStepError(f"flat: f is not shown to give the {state} that its formula has one step later")
    except (TooLongError, ZeroDivisionError) as error:
        raise FailedStepError(f"flat: the formulas are not shown to be those of f: {error}") from None


def _values(flat: FlatForm, later: Sequence[Formula]) -> Values:
    """Return a table with the quotients of all formulas of the flat form, and of the states one step later.

    They are entered before f(X, U), so that a root of a product in f(X, U) is recognised as a product of their roots.
    """
    values = Values()
    values.positive = [values.of(p) for p in flat.positive]
    for formula in (*flat.states, *later, *flat.inputs):
        values.of(formula)
    return values


def _equal_whatever_parts_are(flat: FlatForm, later: Sequence[Formula], a: Formula, b: Formula) -> bool:
    """Return whether a = b is shown with new names in place of the formulas of all states and inputs but one.

    What holds for all values of the new names holds for the formulas. This keeps the polynomials short. Each state and
    input is tried as the one whose formula stays. The formulas `later`, of states one step later, are replaced, too.
    """
    first = 2 + len(flat.positive)
    every = shared_parts([a, b, *flat.positive, *flat.states, *flat.inputs, *later])
    hidden: dict[Formula, Name] = {
        x: Name(f"#{i}") for i, x in enumerate(every[first:]) if not isinstance(x, Name | Number)
    }
    own: list[Formula | None] = [x for x in every[first : len(every) - len(later)] if x in hidden]
    for shown in own or [None]:
        by, values = {x: name for x, name in hidden.items() if x is not shown}, Values()
        p, q, *positive = substitute(every[:first], by)
        try:
            values.positive = [values.of(formula) for formula in positive]
            if values.is_zero(values.of(p) - values.of(q)):
                return True
        except (TooLongError, ZeroDivisionError):
            continue
    return False


def _agree(values: Values, a: Quotient, b: Quotient, up_to_turns: bool) -> bool:
    if not up_to_turns:
        return values.is_zero(a - b)
    pairs = zip(values.direction(a), values.direction(b), strict=True)
    return all(values.is_zero(p - q) for p, q in pairs)


def turns(formula: Formula, angle: str) -> int | None:
    """Return n such that the formula changes by 2π n if the angle changes by 2π; None if no such n is found."""
    found: dict[Formula, int | None] = {}
    for node in parts(formula):
        inner = [found[part] for part in operands(node)]
        n = None if any(i != 0 for i in inner) else 0
        match node, inner:
            case Name(name), _:
                n = int(name == angle)
            case Operation("+"), [int(i), int(j)]:
                n = i + j
            case Operation("-"), [int(i), int(j)]:
                n = i - j
            case Operation("*", Number(value), _), [_, int(j)] if value.is_integer():
                n = int(value) * j
            case Operation("*", _, Number(value)), [int(i), _] if value.is_integer():
                n = int(value) * i
            case Function("sin" | "cos"), [int()]:
                n = 0
        found[node] = n
    return found[formula]


def needs(system: NonlinearSystem, flat: FlatForm) -> list[Need]:
    """Return the conditions under which X, U, X one step later and f(X, U) are defined, for the flat form's X and U.

    The rules of `identities` are true under these conditions, too.
    """
    shared = shared_parts(
        [
            *flat.states,
            *flat.inputs,
            *one_step_later(flat.states),
            *successor_formulas(system, flat),
            *flat.positive,
        ]
    )
    nodes = dict.fromkeys(node for formula in shared for node in parts(formula))
    positive = [Need(p, False) for p in shared[len(shared) - len(flat.positive) :]]
    found = dict.fromkeys([*(need for node in nodes for need in _of_node(node)), *positive])
    return [need for need in found if not _is_clear(need)]


def _of_node(node: Formula) -> Iterable[Need]:
    match node:
        case Operation("/", _, divisor):
            yield Need(divisor, True)
        case Function("log" | "sqrt", argument):
            yield Need(argument, False)
        case Power(base, exponent) if not is_multiplied(exponent):
            yield Need(base, False)
        case Power(base, exponent) if exponent < 0:
            yield Need(base, True)
        case Angle(y, x):
            yield Need(Operation("+", Power(x, 2.0), Power(y, 2.0)), False)


def _is_clear(need: Need) -> bool:
    number = need.formula.value if isinstance(need.formula, Number) else 0.0
    return number > 0 or (need.may_be_negative and number != 0)


def successor_formulas(system: NonlinearSystem, flat: FlatForm) -> list[Formula]:
    """Return f(X, U) for the formulas X, U of the flat form."""
    of = dict(zip((*system.states, *system.inputs), (*flat.states, *flat.inputs), strict=True))
    return substitute(system.f, of)


def one_step_later(formulas: Sequence[Formula]) -> list[Formula]:
    """Return formulas of shifted signals with every signal one step later."""
    every = {name for formula in formulas for name in names(formula)}
    later = {name: Name(shifted_name(s, j + 1)) for name in every for s, j in [indices(name)]}
    return substitute(formulas, later)
