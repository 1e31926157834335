"""Read formulas: nested lists [∘, a, b] with ∘ among + - * /, ["^", a, number] and [function, a]."""

from collections.abc import Iterable

from trackably.checker.formulas.formula import (
    FUNCTIONS,
    SYMBOLS,
    Angle,
    Formula,
    Function,
    Name,
    Number,
    Operation,
    Power,
    parts,
)
from trackably.checker.limits import DEPTH, PARTS
from trackably.checker.reading.names import an_identifier
from trackably.checker.reading.values import UnreadableError, real_number


def a_formula(value: object, where: str) -> Formula:
    """Read a formula. Raise UnreadableError where the lists are none, or nested deeply."""
    return _formula(value, where, DEPTH)


def require_short(formulas: Iterable[Formula], where: str) -> None:
    """Raise UnreadableError where formulas are long together."""
    if sum(len(parts(formula)) for formula in formulas) > PARTS:
        raise UnreadableError(f"{where} must have no more than {PARTS} operations, names and numbers in its formulas")


def _formula(value: object, where: str, deepest: int) -> Formula:
    if not isinstance(value, list):
        return Name(an_identifier(value, where)) if isinstance(value, str) else Number(real_number(value, where))
    if not deepest:
        raise UnreadableError(f"{where} must not be nested more than {DEPTH} deep")
    match value:
        case ["^", base, exponent]:
            return Power(_formula(base, where, deepest - 1), real_number(exponent, where))
        case ["atan2", y, x]:
            return Angle(_formula(y, where, deepest - 1), _formula(x, where, deepest - 1))
        case [symbol, left, right] if symbol in SYMBOLS:
            return Operation(symbol, _formula(left, where, deepest - 1), _formula(right, where, deepest - 1))
        case [function, argument] if function in FUNCTIONS:
            return Function(function, _formula(argument, where, deepest - 1))
    raise UnreadableError(f"{where} must be a formula: [∘, a, b] with ∘ among + - * / ^, or [f, a] with f a function")
