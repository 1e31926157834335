"""Formulas: what is read, and their values in any arithmetic that says where it is not defined."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

from trackable.checker.intervals import INFINITE, ONE, SIGN, Real, cos, exp, iv, log, sin, sqrt
from trackable.checker.reading import UnreadableError, a_name, real_number

Formula = Any
"""A number, a name, or a tuple: (∘, a, b) with ∘ among + - * /, ("^", a, number), or (function, a)."""

FUNCTIONS = ("exp", "log", "sqrt", "sin", "cos")
_DEEPEST, _LONGEST = 100, 1000
MOST_MULTIPLIED = 64
"""Whole exponents up to this size are repeated multiplication; x^p is exp(p log x) for others, defined for x > 0."""


class UndefinedError(ArithmeticError):
    """Something that may not be defined: says what."""


def formula(value: object, where: str) -> Formula:
    """Reads nested lists; UnreadableError where they are no formula, or a long one."""
    found = _formula(value, where, _DEEPEST)
    if sum(1 for _ in written(found)) > _LONGEST:
        raise UnreadableError(f"{where} must have no more than {_LONGEST} operations, names and numbers")
    return found


def _formula(value: object, where: str, deepest: int) -> Formula:
    if not isinstance(value, list):
        return a_name(value, where) if isinstance(value, str) else real_number(value, where)
    if not deepest:
        raise UnreadableError(f"{where} must not be nested more than {_DEEPEST} deep")
    match value:
        case ["^", base, exponent]:
            return "^", _formula(base, where, deepest - 1), real_number(exponent, where)
        case ["+" | "-" | "*" | "/" as symbol, left, right]:
            return symbol, _formula(left, where, deepest - 1), _formula(right, where, deepest - 1)
        case [str(function), argument] if function in FUNCTIONS:
            return function, _formula(argument, where, deepest - 1)
    raise UnreadableError(f"{where} must be a formula: [∘, a, b] with ∘ among + - * / ^, or [f, a] with f a function")


def written(tree: Formula) -> Iterator[Formula]:
    """Every part, as often as it is written."""
    yield tree
    for part in operands(tree):
        yield from written(part)


def operands(tree: Formula) -> tuple[Formula, ...]:
    """The formulas that a formula is made of."""
    if not isinstance(tree, tuple):
        return ()
    return tree[1:2] if tree[0] == "^" else tree[1:]


def names(tree: Formula) -> set[str]:
    """The names in it."""
    return {part for part in written(tree) if isinstance(part, str)}


class Arithmetic(Protocol):
    """What is needed beside + − ·."""

    def constant(self, value: float) -> Any: ...

    def over(self, a: Any, b: Any) -> Any: ...

    def power(self, a: Any, exponent: float) -> Any: ...

    def function(self, name: str, a: Any) -> Any: ...


_SIGNS: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
}


def evaluate(tree: Formula, values: Mapping[str, Any], arithmetic: Arithmetic) -> Any:
    """The value where names have these values. UndefinedError where there may be none."""
    known: dict[int, Any] = {}

    def at(node: Formula) -> Any:
        if isinstance(node, str):
            return values[node]
        if not isinstance(node, tuple):
            return arithmetic.constant(node)
        if id(node) not in known:
            known[id(node)] = combine(node[0], [at(part) for part in operands(node)], node[-1])
        return known[id(node)]

    def combine(kind: str, parts: list[Any], last: Any) -> Any:
        if kind == "^":
            return arithmetic.power(parts[0], last)
        if kind == "/":
            return arithmetic.over(*parts)
        return _SIGNS[kind](*parts) if kind in _SIGNS else arithmetic.function(kind, parts[0])

    return at(tree)


def required(condition: bool, what: str) -> None:
    """UndefinedError unless the condition is certain."""
    if not condition:
        raise UndefinedError(what)


NOT_ZERO = "what it divides by may be zero"


def require_nonzero(x: Real) -> None:
    """UndefinedError where an interval holds zero."""
    required(bool(x.a > 0 or x.b < 0), NOT_ZERO)


def require_positive(function: str, x: Real) -> None:
    """UndefinedError where a function that wants a positive number may not get one."""
    if function in ("log", "sqrt", "power"):
        what = {"log": "logarithm", "sqrt": "square root", "power": "fractional power"}[function]
        required(bool(x.a > 0), f"the argument of a {what} may not be positive")


def is_multiplied(exponent: float) -> bool:
    """Whether a power is repeated multiplication."""
    return exponent.is_integer() and abs(exponent) <= MOST_MULTIPLIED


class Intervals:
    """Formulas at intervals: whatever numbers they hold, the value lies in the result."""

    def constant(self, value: float) -> Real:
        return iv.mpf(value)

    def over(self, a: Real, b: Real) -> Real:
        require_nonzero(b)
        return a / b

    def power(self, a: Real, exponent: float) -> Real:
        if is_multiplied(exponent):
            return whole_power(a, int(exponent))
        require_positive("power", a)
        return bounded(exp(iv.mpf(exponent) * log(a)))

    def function(self, name: str, a: Real) -> Real:
        require_positive(name, a)
        required(bool(abs(a).b < 1e100), "an argument of a function has no bound")
        return bounded({"exp": exp, "log": log, "sqrt": sqrt, "sin": sin, "cos": cos}[name](a))


def slope_of(name: str, a: Real) -> Real:
    """Holds φ′(ξ) for each ξ of an interval on which φ is defined."""
    if name in ("sin", "cos"):
        return cos(a) if name == "sin" else -sin(a)
    return exp(a) if name == "exp" else ONE / (a if name == "log" else 2 * sqrt(a))


def whole_power(a: Real, exponent: int) -> Real:
    """a^exponent; of an interval across zero too."""
    if exponent < 0:
        require_nonzero(a)
        return ONE / whole_power(a, -exponent)
    if exponent % 2 or not (a.a < 0 < a.b):
        return a**exponent
    return iv.mpf([0, (abs(a) ** exponent).b])


def bounded(x: Real) -> Real:
    """The interval itself; UndefinedError where it has no bounds."""
    required(bool(abs(x).b < INFINITE.b), "nothing bounds it")
    return x


def around(middle: Real, reach: Real) -> Real:
    """All numbers within `reach` of `middle`."""
    return middle + SIGN * iv.mpf([0, reach.b])


def text(tree: Formula) -> str:
    """As it is read, with every parenthesis."""
    if not isinstance(tree, tuple):
        return tree if isinstance(tree, str) else repr(tree)
    if tree[0] in FUNCTIONS:
        return f"{tree[0]}({text(tree[1])})"
    last = repr(tree[2]) if tree[0] == "^" else text(tree[2])
    return f"({text(tree[1])} {tree[0]} {last})"
