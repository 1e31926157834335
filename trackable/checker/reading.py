"""Reading: exactly the fields there are; numbers finite and exact in float64; nothing converted."""

import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any


class UnreadableError(ValueError):
    """Names the first part that is missing, unknown or of a wrong kind."""


def read(value: object, shape: Any, where: str) -> Any:
    """A value of this shape: a dict of shapes (... stands for all names), a list of one, or a function that reads."""
    if isinstance(shape, dict) and set(shape) == {...}:
        if not isinstance(value, dict):
            raise UnreadableError(f"{where} must be an object")
        return {a_name(name, where): read(inner, shape[...], f"{where}.{name}") for name, inner in value.items()}
    if isinstance(shape, dict):
        if not isinstance(value, dict) or set(value) != set(shape):
            raise UnreadableError(f"{where} must be an object with exactly the fields {', '.join(shape)}")
        return {name: read(value[name], inner, f"{where}.{name}") for name, inner in shape.items()}
    if isinstance(shape, list):
        if not isinstance(value, list) or not value:
            raise UnreadableError(f"{where} must be a list, not empty")
        return [read(item, shape[0], f"{where}[{i}]") for i, item in enumerate(value)]
    return shape(value, where)


def real_number(value: object, where: str) -> float:
    """A finite number that float64 holds exactly."""
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not abs(value) < 2**1023
        or float(value) != value
    ):
        raise UnreadableError(f"{where} must be a finite number, exact in float64")
    return float(value)


def positive_number(value: object, where: str) -> float:
    """One that is positive."""
    if not real_number(value, where) > 0:
        raise UnreadableError(f"{where} must be positive")
    return real_number(value, where)


def whole_number(value: object, where: str) -> int:
    """A positive count."""
    if type(value) is not int or not 0 < value <= 1_000_000:
        raise UnreadableError(f"{where} must be a positive whole number, a million at most")
    return value


def a_name(value: object, where: str) -> str:
    """A short text."""
    if not isinstance(value, str) or not 0 < len(value) <= 200:
        raise UnreadableError(f"{where} must be a name")
    return value


def rational_number(value: object, where: str) -> Fraction:
    """A text such as -3/4."""
    if not isinstance(value, str) or len(value) > 20_000 or not re.fullmatch(r"-?[0-9]+(/0*[1-9][0-9]*)?", value):
        raise UnreadableError(f"{where} must be a rational number, as in -3/4")
    numerator, _, denominator = value.partition("/")
    return Fraction(_integer(numerator), _integer(denominator or "1"))


def _integer(digits: str) -> int:
    """Python limits how many decimal digits it reads at once."""
    sign, digits = (-1, digits[1:]) if digits.startswith("-") else (1, digits)
    value = 0
    for i in range(0, len(digits), 4000):
        value = value * 10 ** len(digits[i : i + 4000]) + int(digits[i : i + 4000])
    return sign * value


def only(wanted: object) -> Callable[[object, str], object]:
    """Reads this one value."""

    def reader(value: object, where: str) -> object:
        if type(value) is not type(wanted) or value != wanted:
            raise UnreadableError(f"{where} must be {wanted!r}")
        return value

    return reader


def one_of(tag: str, shapes: dict[str, dict[str, Any]]) -> Callable[[object, str], object]:
    """Reads an object of the shape that its field `tag` names."""

    def reader(value: object, where: str) -> object:
        kind = value.get(tag) if isinstance(value, dict) else None
        if not isinstance(kind, str) or kind not in shapes:
            raise UnreadableError(f"{where}.{tag} must be one of {', '.join(shapes)}")
        if where.count(".") > 40:
            raise UnreadableError(f"{where} is nested too deeply")
        return read(value, {tag: only(kind), **shapes[kind]}, where)

    return reader
