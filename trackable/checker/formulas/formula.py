"""Formulas as trees, and their values in any arithmetic."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol, Self, TypeVar

Symbol = Literal["+", "-", "*", "/"]
SYMBOLS: tuple[Symbol, ...] = ("+", "-", "*", "/")
FUNCTIONS = ("exp", "log", "sqrt", "sin", "cos")


@dataclass(frozen=True, eq=False)
class Number:
    """A constant."""

    value: float


@dataclass(frozen=True, eq=False)
class Name:
    """A state, an input, or a state one step later."""

    name: str


@dataclass(frozen=True, eq=False)
class Operation:
    """left + right, left − right, left · right or left / right."""

    symbol: Symbol
    left: "Formula"
    right: "Formula"


@dataclass(frozen=True, eq=False)
class Power:
    """base^exponent."""

    base: "Formula"
    exponent: float


@dataclass(frozen=True, eq=False)
class Function:
    """One of `FUNCTIONS` of an argument."""

    function: str
    argument: "Formula"


Formula = Number | Name | Operation | Power | Function


class Summand(Protocol):
    """Values that formulas add, subtract and multiply."""

    def __add__(self, other: Self, /) -> Self: ...
    def __sub__(self, other: Self, /) -> Self: ...
    def __mul__(self, other: Self, /) -> Self: ...


T = TypeVar("T", bound=Summand)


class Arithmetic(Protocol[T]):
    """What formulas need beside + − ·; each raises UndefinedError where there may be no value."""

    def constant(self, value: float, /) -> T: ...

    def over(self, a: T, b: T, /) -> T: ...

    def power(self, a: T, exponent: float, /) -> T: ...

    def function(self, name: str, a: T, /) -> T: ...


def evaluate(formula: Formula, values: Mapping[str, T], arithmetic: Arithmetic[T]) -> T:
    """Return the value where names have these values. Raise UndefinedError where there may be none."""
    known: dict[Formula, T] = {}

    def at(node: Formula) -> T:
        if node not in known:
            known[node] = compute(node)
        return known[node]

    def compute(node: Formula) -> T:  # noqa: PLR0911  a line for each kind of node
        match node:
            case Number(value):
                return arithmetic.constant(value)
            case Name(name):
                return values[name]
            case Operation("+", left, right):
                return at(left) + at(right)
            case Operation("-", left, right):
                return at(left) - at(right)
            case Operation("*", left, right):
                return at(left) * at(right)
            case Operation(_, left, right):
                return arithmetic.over(at(left), at(right))
            case Power(base, exponent):
                return arithmetic.power(at(base), exponent)
            case Function(function, argument):
                return arithmetic.function(function, at(argument))

    return at(formula)


def operands(formula: Formula) -> tuple[Formula, ...]:
    """Return the formulas that a formula is made of."""
    match formula:
        case Operation(_, left, right):
            return left, right
        case Power(inner, _) | Function(_, inner):
            return (inner,)
    return ()


def written(formula: Formula) -> Iterator[Formula]:
    """Yield every part, as often as it is written."""
    yield formula
    for part in operands(formula):
        yield from written(part)


def names(formula: Formula) -> set[str]:
    """Return the names in a formula."""
    return {part.name for part in written(formula) if isinstance(part, Name)}


def numbers(formula: Formula) -> list[float]:
    """Return the constants and exponents in a formula."""
    parts = list(written(formula))
    exponents = [part.exponent for part in parts if isinstance(part, Power)]
    return [part.value for part in parts if isinstance(part, Number)] + exponents


def text(formula: Formula) -> str:
    """Return a formula in words, with every parenthesis."""
    match formula:
        case Number(value):
            return repr(value)
        case Name(name):
            return name
        case Operation(symbol, left, right):
            return f"({text(left)} {symbol} {text(right)})"
        case Power(base, exponent):
            return f"({text(base)} ^ {exponent!r})"
        case Function(function, argument):
            return f"{function}({text(argument)})"
