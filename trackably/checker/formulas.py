"""Formulas of a nonlinear system as trees."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from operator import add, mul, sub, truediv
from typing import Any, Literal

from trackably.checker.watch import tick

Symbol = Literal["+", "-", "*", "/"]
SYMBOLS: tuple[Symbol, ...] = ("+", "-", "*", "/")
OPERATORS: Mapping[Symbol, Callable[[Any, Any], Any]] = dict(zip(SYMBOLS, (add, sub, mul, truediv), strict=True))
FUNCTIONS = ("exp", "log", "sqrt", "sin", "cos", "atan")

LETTER = "A-Za-zÀ-ÖØ-öø-ſΓΔΘΛΞΠΣΦΨΩα-ξπ-ωϑϕḀ-ỿ"
_WORD = f"[{LETTER}_][{LETTER}0-9₀-₉_-]{{0,59}}"
_INDEX_OR_UNIT = f"[{LETTER}µ0-9²³¹⁻_/·*^°%-]{{1,58}}"
IDENTIFIER = rf"(?!.{{61}}){_WORD}(\[{_INDEX_OR_UNIT}\]|\({_INDEX_OR_UNIT}\))*"
"""The pattern of names of states and inputs, which cannot be taken for a part of a sentence or of a formula."""


@dataclass(frozen=True, eq=False)
class Number:
    """A constant in a formula."""

    value: float


@dataclass(frozen=True, eq=False)
class Name:
    """The name of a state, an input, a state one step later, or a shifted signal."""

    name: str


@dataclass(frozen=True, eq=False)
class Operation:
    """The operation left + right, left − right, left · right or left / right; `symbol` says which one."""

    symbol: Symbol
    left: "Formula"
    right: "Formula"


@dataclass(frozen=True, eq=False)
class Power:
    """The power base^exponent, with a constant exponent."""

    base: "Formula"
    exponent: float


@dataclass(frozen=True, eq=False)
class Function:
    """A function of one argument; `FUNCTIONS` has the names of all functions."""

    function: str
    argument: "Formula"


@dataclass(frozen=True, eq=False)
class Angle:
    """atan2(y, x) in (−π, π]; undefined if both are zero."""

    y: "Formula"
    x: "Formula"


Formula = Number | Name | Operation | Power | Function | Angle


def parts(formula: Formula, besides: Collection[Formula] = ()) -> list[Formula]:
    """Return every part of a formula once, operands before the parts that use them; a part may be used repeatedly.

    Parts that are in `besides`, with all of their own parts, are left out.
    """
    found: dict[Formula, None] = {}
    waiting = [] if formula in besides else [formula]
    while waiting:
        tick()
        node = waiting[-1]
        missing = [part for part in operands(node) if part not in found and part not in besides]
        if missing:
            waiting += missing
        else:
            found[waiting.pop()] = None
    return list(found)


def operands(formula: Formula) -> tuple[Formula, ...]:
    """Return the operands of a formula."""
    return tuple([value for value in vars(formula).values() if not isinstance(value, str | int | float)])


def rewritten(
    formulas: Sequence[Formula], change: Callable[[Formula, Mapping[Formula, Formula]], Formula | None]
) -> list[Formula]:
    """Return the formulas with each part replaced by `change(part, done)`, operands before the parts that use them.

    `done` has the replacements so far. If `change` returns None, the part stays, but with its operands replaced.
    """
    done: dict[Formula, Formula] = {}
    for formula in formulas:
        for node in parts(formula, done):
            done[node] = change(node, done) or remade(node, done)
    return [done[formula] for formula in formulas]


def remade(node: Formula, of: Mapping[Formula, Formula]) -> Formula:
    """Return the formula `node` with each operand replaced by of[operand], or kept if `of` does not have it."""
    return type(node)(*(of.get(value, value) for value in vars(node).values())) if operands(node) else node


def shared_parts(formulas: Sequence[Formula]) -> list[Formula]:
    """Return the formulas with one object for all parts that are equal as written, so that it is evaluated once."""
    first: dict[tuple[object, ...], Formula] = {}

    def first_equal(node: Formula, done: Mapping[Formula, Formula]) -> Formula:
        made = remade(node, done)
        return first.setdefault((type(made), *vars(made).values()), made)

    return rewritten(formulas, first_equal)


def names(formula: Formula) -> set[str]:
    """Return the names in a formula."""
    return {part.name for part in parts(formula) if isinstance(part, Name)}


def numbers(formula: Formula) -> list[float]:
    """Return the constants and exponents in a formula."""
    every = parts(formula)
    exponents = [part.exponent for part in every if isinstance(part, Power)]
    return [part.value for part in every if isinstance(part, Number)] + exponents


def text(formula: Formula, deepest: int = 1000) -> str:
    """Return a formula as text, with every parenthesis, and names in quotes.

    Parts nested deeper than `deepest` are left out.
    """
    inner = [text(part, deepest - 1) for part in operands(formula)] if deepest else []
    match formula:
        case _ if not deepest:
            found = "…"
        case Number(value):
            found = repr(value) if value >= 0 else f"({value!r})"
        case Name(name):
            found = f'"{name}"'
        case Operation(symbol):
            found = f"({inner[0]} {symbol} {inner[1]})"
        case Power(_, exponent):
            found = f"({inner[0]} ^ {exponent!r})"
        case Function(function):
            found = f"{function}({inner[0]})"
        case Angle():
            found = f"atan2({inner[0]}, {inner[1]})"
    return found
