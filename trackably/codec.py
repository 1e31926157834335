"""Convert the library's frozen dataclasses to JSON and back, losslessly: every float64 returns bit for bit.

Reading is strict. An object has exactly the fields of its class, and nothing is converted: strings and truth values are
no numbers, and NaN and infinities are refused. The name of a kernel in the registry is the field `type`, a formula is
nested lists, a learned hyperparameter is an object with `learned` and `interval`, and a rational number is a text. If
a field may hold one of several classes, the object is read as the class of which it lacks the fewest fields.
"""

import sys
from collections.abc import Mapping, Set
from dataclasses import MISSING, Field, astuple, dataclass, fields, is_dataclass
from fractions import Fraction
from functools import cache, partial
from reprlib import repr as short
from types import UnionType
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np

from trackably.arrays import Array
from trackably.checker.form import (
    Reader,
    a_formula,
    a_pair,
    by_name,
    by_tag,
    many,
    one_of,
    rational_number,
    record,
)
from trackably.checker.formulas import Formula
from trackably.files import from_json, to_json
from trackably.gp.hyperparameter import Hyperparameter, Learned
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.registry import KERNELS, name_of
from trackably.systems.formulas import is_float64, to_lists
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import Polytope

_LEFT_OUT = {
    *("flat", "angles", "positive", "scatters", "noise", "model_error", "tightening", "truth"),
    *("condensed", "pinned", "limited", "budget", "spread", "free", "backoff"),
}
"""Names of fields that are left out of files if they have their default value."""

T = TypeVar("T")


class CodecError(ValueError):
    """A value cannot be written as JSON, or JSON cannot be read as a value; the message says where ($ is the root)."""


@dataclass(frozen=True)
class LearnedHyperparameter:
    """The JSON of a `Learned` hyperparameter: its value, and the interval in which it was searched."""

    learned: float
    interval: tuple[float, float] | None


def encode(value: object) -> Any:
    """Return a dataclass as nested dicts, lists, strings and numbers, which `decode` reads.

    CodecError: it cannot be written as JSON.
    """
    if isinstance(value, type) or not is_dataclass(value):
        raise CodecError(f"only a dataclass of the library can be written as JSON, got {short(value)}")
    data = encode_unverified(value)
    decode(type(value), data)
    return data


def encode_unverified(value: object) -> Any:  # noqa: PLR0911  one form for each type
    """Return the same as `encode`, but do not verify that `decode` reads the result.

    This is meant for certificates, which only the checker reads.
    """
    match value:
        case Learned():
            return encode_unverified(LearnedHyperparameter(float(value), value.interval))
        case float():
            return float(value)
        case Fraction():
            return str(value)
        case np.ndarray():
            return value.tolist()
        case np.generic():
            return value.item()
        case Mapping():
            return {encode_unverified(name): encode_unverified(of) for name, of in value.items()}
        case Set():
            return sorted(map(encode_unverified, value))
        case tuple() | list():
            return [encode_unverified(of) for of in value]
        case Polytope():  # a bound that moves in time is written as an object, not as a number
            low, high = map(encode_unverified, value.ends)
            return {"rows": value.rows.tolist(), "lower": low, "upper": high, "dimension": value.dimension}
    if isinstance(value, Formula):
        return to_lists(value)
    if isinstance(value, type) or not is_dataclass(value):
        return value
    try:
        tag = {"type": name_of(type(value))} if isinstance(value, Kernel) else {}
    except ValueError as error:
        raise CodecError(str(error)) from error
    known = [(field, getattr(value, field.name)) for field in fields(value)]
    left = ((field.name, of) for field, of in known if not (_is_left_out(field) and of is field.default))
    return tag | {name: encode_unverified(of) for name, of in left}


def decode(wanted: type[T], data: object) -> T:
    """Return the value of type `wanted` whose `encode` is `data`. CodecError: there is none."""
    try:
        value = _read(wanted, data, "$")
        if encode_unverified(value) != data:  # a class may change or complete what it is given
            raise CodecError("$ must be the JSON that the library writes for this value; write the value again")
    except ValueError as error:
        raise CodecError(f"{wanted.__name__}: {error}") from error
    return cast(T, value)


def dumps(value: object) -> bytes:
    """Return the bytes of a JSON file with the content `encode(value)`."""
    return to_json(encode(value))


def loads(wanted: type[T], data: bytes) -> T:
    """Return `decode` of a JSON file's content. CodecError: `data` is not strict JSON, or not of the type `wanted`."""
    try:
        content = from_json(data)
    except ValueError as error:
        raise CodecError(f"{wanted.__name__}: {error}") from error
    return decode(wanted, content)


def _read(wanted: Any, data: Any, where: str) -> Any:  # noqa: PLR0911  one form for each type
    """Return `data` as a value of the type `wanted`. ValueError, which names the place `where`: it has another type."""
    kind, inner = get_origin(wanted) or wanted, get_args(wanted)
    if wanted in _READERS:
        return _READERS[wanted](data, where)
    if kind in (Union, UnionType):
        return None if data is None and type(None) in inner else _read(_best(inner, data), data, where)
    if kind is Literal:
        return one_of(inner)(data, where)
    if kind is np.ndarray:
        return _read_array(data, where)
    readers = [partial(_read, of) for of in inner]
    if kind in (Mapping, dict):
        return by_name(*readers)(data, where)
    if kind is tuple and inner[-1] is not ...:
        return a_pair(*readers)(data, where)
    if kind in (tuple, list, frozenset):
        return kind(many(readers[0], sys.maxsize, empty=True)(data, where))
    if not is_dataclass(wanted):
        raise CodecError(f"{where} has the type {wanted}, which cannot be read from JSON")
    return _read_dataclass(wanted, data, where)


def _read_float(data: Any, where: str) -> float:
    """Return a finite number that float64 holds exactly."""
    if not is_float64(data):
        raise CodecError(f"{where} must be a finite number, exact in float64, got {short(data)}")
    return float(data)


def _read_hyperparameter(data: Any, where: str) -> float:
    """Return a known hyperparameter, which is a number, or a learned one."""
    if isinstance(data, dict):
        return Learned(*astuple(_read_dataclass(LearnedHyperparameter, data, where)))
    return _read_float(data, where)


def _read_same(wanted: type, data: Any, where: str) -> Any:
    """Return `data` if it has exactly this type: True is no int."""
    if type(data) is not wanted:
        raise CodecError(f"{where} must be of type {wanted.__name__}, got {short(data)}")
    return data


_READERS: dict[Any, Reader[Any]] = {
    float: _read_float,
    Hyperparameter: _read_hyperparameter,
    Fraction: rational_number,
    **dict.fromkeys((Formula, *get_args(Formula)), a_formula),
    **{kind: partial(_read_same, kind) for kind in (int, bool, str)},
}


def _read_array(data: Any, where: str) -> Array:
    """Return nested lists of numbers as an array."""
    if not isinstance(data, list):
        return np.array(_read_float(data, where))
    items = many(_read_array, sys.maxsize, empty=True)(data, where)
    if len({item.shape for item in items}) > 1:
        raise CodecError(f"{where} must be lists of one length, got {short(data)}")
    return np.array(items, dtype=float)


def _best(kinds: tuple[Any, ...], data: Any) -> Any:
    """Return the type to read `data` as: for an object, the class of which it lacks the fewest fields.

    For numbers, texts and lists, it is the type that is no dataclass.
    """
    given = set(data) if isinstance(data, dict) else set[str]()
    some = [kind for kind in kinds if kind is not type(None)]
    return min(some, key=lambda kind: len(_required_fields(kind) - given) if is_dataclass(kind) else bool(given))


def _required_fields(wanted: Any) -> set[str]:
    return {field.name for field in fields(wanted) if not _is_left_out(field)}


def _read_dataclass(wanted: Any, data: Any, where: str) -> Any:
    if issubclass(wanted, Kernel):
        known = {name: partial(_read_fields, kind) for name, kind in KERNELS.items() if issubclass(kind, wanted)}
        return by_tag("type", known)(data, where)
    return _read_fields(wanted, data, where)


def _read_fields(wanted: Any, data: Any, where: str) -> Any:
    hints, required = _hints(wanted), _required_fields(wanted)

    def make(**values: Any) -> Any:
        try:
            return wanted(**values)
        except (ValueError, TypeError, ArithmeticError, LookupError) as error:
            raise CodecError(f"{where}: {str(error) or type(error).__name__}") from error

    readers = {name: partial(_read, of) for name, of in hints.items()}
    optional = {name: readers.pop(name) for name in hints if name not in required}
    return record(make, optional, **readers)(data, where)


@cache
def _hints(wanted: Any) -> dict[str, Any]:
    """Return the types of the fields of a dataclass, by name."""
    hints = get_type_hints(wanted)
    if wanted is Polytope:  # an end of a bound is a number, or an object if it moves in time
        hints |= dict.fromkeys(("lower", "upper"), tuple[float | PolynomialPieces, ...])
    return {field.name: hints[field.name] for field in fields(wanted)}


def _is_left_out(field: Field[Any]) -> bool:
    """Whether a field is left out of the JSON if it has its default value."""
    return field.name in _LEFT_OUT and field.default is not MISSING
