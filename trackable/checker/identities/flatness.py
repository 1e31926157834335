"""Step 0 of the proof, flat forms: f(X, U) is X one step later, and what must hold so that all of it has values."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from trackable.checker.formulas.formula import (
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
)
from trackable.checker.identities.polynomials import Quotient, TooLongError
from trackable.checker.identities.values import Values
from trackable.checker.subject import FlatForm, NonlinearSystem, indices, shifted_name


@dataclass(frozen=True)
class Need:
    """A formula that must be positive; if it `may_be_negative`, it must only not be zero."""

    formula: Formula
    may_be_negative: bool


def why_not_flat(system: NonlinearSystem, flat: FlatForm) -> str | None:
    """Return which state is not shown to get to X one step later; None where all do."""
    for state, formula in zip(system.states, system.f, strict=True):
        for angle in flat.angles:
            turned = turns(formula, angle)
            if turned is None or (turned and state not in flat.angles):
                return (
                    f"flat: {state} may change if the angle {angle} is turned by 2π, by more than whole turns of angles"
                )
    values, later, reached = Values(), _later(flat), _reached(system, flat)
    try:
        values.positive = [values.of(p) for p in flat.positive]
        for formula in (*flat.states, *later, *flat.inputs):
            values.of(formula)
        for state, a, b in zip(system.states, reached, later, strict=True):
            if not _agree(values, values.of(a), values.of(b), state in flat.angles):
                return f"flat: f does not lead {state} to its formula one step later, or is not shown to"
    except (TooLongError, ZeroDivisionError) as error:
        return f"flat: the formulas are not shown to be those of f: {error}"
    return None


def _agree(values: Values, a: Quotient, b: Quotient, up_to_turns: bool) -> bool:
    if not up_to_turns:
        return values.is_zero(a - b)
    pairs = zip(values.direction(a), values.direction(b), strict=True)
    return all(values.is_zero(p - q) for p, q in pairs)


def turns(formula: Formula, angle: str) -> int | None:
    """Return n such that the formula changes by 2π n where the angle changes by 2π; None where no n is seen."""
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
    """Return what must hold where X, U, X one step later and f(X, U) are defined, and where the rules are true."""
    found: dict[tuple[object, bool], Need] = {}
    told: dict[Formula, object] = {}
    seen: dict[object, int] = {}
    for formula in (*flat.states, *flat.inputs, *_later(flat), *_reached(system, flat), *flat.positive):
        for node in parts(formula):
            for need in _of_node(node):
                found.setdefault((_structure(need.formula, told, seen), need.may_be_negative), need)
    for p in flat.positive:
        found.setdefault((_structure(p, told, seen), False), Need(p, False))
    return [need for need in found.values() if not _is_clear(need)]


def _of_node(node: Formula) -> Iterable[Need]:
    match node:
        case Operation("/", _, divisor):
            yield Need(divisor, True)
        case Function("log" | "sqrt", argument):
            yield Need(argument, False)
        case Power(base, exponent) if not exponent.is_integer():
            yield Need(base, False)
        case Power(base, exponent) if exponent < 0:
            yield Need(base, abs(exponent) <= 64)
        case Power(base, exponent) if exponent > 64:
            yield Need(base, False)
        case Angle(y, x):
            yield Need(Operation("+", Power(x, 2.0), Power(y, 2.0)), False)


def _is_clear(need: Need) -> bool:
    number = need.formula.value if isinstance(need.formula, Number) else 0.0
    return number > 0 or (need.may_be_negative and number != 0)


def _structure(formula: Formula, told: dict[Formula, object], seen: dict[object, int]) -> object:
    """Return the same number for formulas that are written alike."""
    for node in parts(formula):
        if node not in told:
            inner = tuple(told[part] for part in operands(node))
            match node:
                case Number(value):
                    what: object = value
                case Name(name):
                    what = name
                case Operation(symbol):
                    what = symbol
                case Power(_, exponent):
                    what = ("power", exponent)
                case Function(function):
                    what = ("function", function)
                case Angle():
                    what = "atan2"
            told[node] = seen.setdefault((type(node), what, inner), len(seen))
    return told[formula]


def _reached(system: NonlinearSystem, flat: FlatForm) -> list[Formula]:
    """Return f(X, U)."""
    of = dict(zip((*system.states, *system.inputs), (*flat.states, *flat.inputs), strict=True))
    return _replaced(system.f, of)


def _later(flat: FlatForm) -> list[Formula]:
    """Return X one step later."""
    every = {name for formula in flat.states for name in names(formula)}
    later = {name: Name(shifted_name(s, j + 1)) for name in every for s, j in [indices(name)]}
    return _replaced(flat.states, later)


def _replaced(formulas: Sequence[Formula], by: Mapping[str, Formula]) -> list[Formula]:
    """Return formulas with formulas in the place of names."""
    found: dict[Formula, Formula] = {}
    for formula in formulas:
        for node in parts(formula):
            match node:
                case Name(name):
                    found[node] = by.get(name, node)
                case Operation(symbol, left, right):
                    found[node] = Operation(symbol, found[left], found[right])
                case Power(base, exponent):
                    found[node] = Power(found[base], exponent)
                case Function(function, argument):
                    found[node] = Function(function, found[argument])
                case Angle(y, x):
                    found[node] = Angle(found[y], found[x])
                case _:
                    found[node] = node
    return [found[formula] for formula in formulas]
