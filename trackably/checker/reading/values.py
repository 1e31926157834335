"""Read single values strictly: exactly the fields there are, numbers finite and exact in float64, nothing converted."""

import re
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import TypeVar

from trackably.checker.limits import DIGITS, TEXTS
from trackably.checker.watch import tick

T = TypeVar("T")
Reader = Callable[[object, str], T]
"""Reads a value found at a place in the certificate; the place is named in messages."""


class UnreadableError(ValueError):
    """The data is no certificate; the message names the first part that is missing, unknown or of a wrong kind."""


FORMER_NAME = "trackable"
"""The library's name when it wrote its first certificates: they are read for ever."""


def format_of(data: object) -> str | None:
    """Return what a file says it is, in today's words; None where it does not say so."""
    found = data.get("format") if isinstance(data, dict) else None
    if not isinstance(found, str):
        return None
    return f"trackably {rest}" if (rest := found.removeprefix(f"{FORMER_NAME} ")) != found else found


def require_short_texts(data: object) -> None:
    """Raise UnreadableError where all texts together, but for names of fields, are longer than any proof needs."""
    waiting, found = [data], 0
    while waiting:
        tick()
        inner = waiting.pop()
        for value in inner.values() if isinstance(inner, dict) else inner if isinstance(inner, list) else ():
            if isinstance(value, str):
                found += len(value)
            elif isinstance(value, dict | list):
                waiting.append(value)
        if found > TEXTS:
            raise UnreadableError(f"its texts must have no more than {TEXTS} characters together")


class Fields:
    """The fields of an object, each of which is read by the reader that belongs to it."""

    def __init__(self, value: object, where: str, *names: str) -> None:
        if not isinstance(value, dict) or set(value) != set(names):
            raise UnreadableError(f"{where} must be an object with exactly the fields {', '.join(names)}")
        self._value: dict[object, object] = value
        self._where = where

    def __contains__(self, name: str) -> bool:
        return name in self._value

    def __call__(self, name: str, reader: Reader[T]) -> T:
        return reader(self._value[name], f"{self._where}.{name}")


def tag_of(value: object, where: str, tag: str, known: Mapping[str, object]) -> str:
    """Return the text in the field `tag`, which must be one of those known."""
    found: object = value.get(tag) if isinstance(value, dict) else None
    if not isinstance(found, str) or found not in known:
        raise UnreadableError(f"{where}.{tag} must be one of {', '.join(known)}")
    return found


def many(reader: Reader[T], most: int, empty: bool = False) -> Reader[tuple[T, ...]]:
    """Read a list of so many values at most, which must not be empty unless that is allowed."""

    def read(value: object, where: str) -> tuple[T, ...]:
        if not isinstance(value, list) or not (value or empty):
            raise UnreadableError(f"{where} must be a list{'' if empty else ', not empty'}")
        if len(value) > most:
            raise UnreadableError(f"{where} must have no more than {most} entries, got {len(value)}")
        return tuple(reader(item, f"{where}[{i}]") for i, item in enumerate(value))

    return read


def by_name(a_name: Reader[str], reader: Reader[T]) -> Reader[dict[str, T]]:
    """Read an object whose keys are names of this kind."""

    def read(value: object, where: str) -> dict[str, T]:
        if not isinstance(value, dict):
            raise UnreadableError(f"{where} must be an object")
        return {a_name(name, where): reader(item, f"{where}.{name}") for name, item in value.items()}

    return read


def real_number(value: object, where: str) -> float:
    """Read a finite number that float64 holds exactly."""
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not abs(value) < 2**1023
        or float(value) != value
    ):
        raise UnreadableError(f"{where} must be a finite number, exact in float64")
    return float(value)


def positive_number(value: object, where: str) -> float:
    """Read a positive number."""
    number = real_number(value, where)
    if not number > 0:
        raise UnreadableError(f"{where} must be positive")
    return number


def exact_number(value: object, where: str) -> Fraction:
    """Read a float64 as the rational number that it is."""
    return Fraction(real_number(value, where))


def whole_number(most: int) -> Reader[int]:
    """Read a positive count."""

    def read(value: object, where: str) -> int:
        if type(value) is not int or not 0 < value <= most:
            raise UnreadableError(f"{where} must be a positive whole number, {most} at most")
        return value

    return read


def rational_number(value: object, where: str) -> Fraction:
    """Read a text such as -3/4."""
    if not isinstance(value, str) or len(value) > DIGITS or not re.fullmatch(r"-?[0-9]+(/0*[1-9][0-9]*)?", value):
        raise UnreadableError(f"{where} must be a rational number, as in -3/4, of {DIGITS} characters at most")
    tick()
    numerator, _, denominator = value.partition("/")
    return Fraction(int(numerator), int(denominator or "1"))
