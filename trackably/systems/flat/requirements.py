"""What must hold so that formulas have values: divisors are not zero, arguments of roots and logarithms positive."""

from collections.abc import Iterable
from dataclasses import dataclass

from trackably.systems.formulas.expression import (
    Angle,
    Constant,
    Expression,
    Function,
    Power,
    Quotient,
    Sum,
    all_nodes,
    outline,
)

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
