"""Read systems and sets from the mappings in files: params.yaml, and files for the command line.

Each ValueError begins with the name of the wrong field.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from reprlib import repr as short
from typing import Any, TypeVar

import numpy as np

from trackably.arguments import is_number
from trackably.systems.constrained import System
from trackably.systems.library import model_of
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

T = TypeVar("T")
Numbers = tuple[float, ...]
Rows = tuple[Numbers, ...]

_LINEAR = ("A", "B", "c", "continuous", "states", "inputs", "sampling_time")
_NAMED = ("model", "sampling_time", "parameters")


def system_of(written: object) -> System:
    """Return the system that a mapping describes.

    It is linear (`A`, `B`, `c`, `continuous`, `states`, `inputs`, `sampling_time`), or a `model` of the library by its
    name, with its `sampling_time` and further `parameters`. A `continuous` system is sampled with its input held.

    ValueError or TypeError: `written` describes no system.
    """
    if isinstance(written, Mapping) and "model" in written:
        given = fields_of(written, _NAMED, ["sampling_time"])
        if not isinstance(parameters := given.get("parameters", {}), Mapping):
            raise ValueError(f"parameters: expected a mapping from names to numbers, got {short(parameters)}")
        return model_of(str(given["model"]), given["sampling_time"], parameters)
    given = fields_of(written, _LINEAR, ["A", "B", "sampling_time"])
    if not isinstance(continuous := given.get("continuous", False), bool):
        raise ValueError(f"continuous: expected true or false, got {short(continuous)}")
    A, B = (read_part(given, name, matrix) for name in ("A", "B"))
    return (LinearSystem.discretised if continuous else LinearSystem)(
        A,
        B,
        c=None if given.get("c") is None else read_part(given, "c", vector),
        states=given.get("states", ()),
        inputs=given.get("inputs", ()),
        sampling_time=given["sampling_time"],
    )


def set_of(written: object) -> Polytope:
    """Return the set that a mapping describes.

    It is a box (`lower`, `upper`), the half-spaces `H` x ≤ `h`, or the intersection of both; or, with `rows`, the set
    `lower` ≤ `rows` x ≤ `upper`. A coordinate of a box is free where both of its bounds are null. A bound that moves
    in time is a mapping, as `PolynomialPieces.from_mapping` reads it.

    ValueError or TypeError: `written` describes no set.
    """
    given = fields_of(written, _READERS)
    known = tuple(name for name in _READERS if name in given)
    if known not in _SETS:
        raise ValueError(
            "expected lower with upper, H with h, or all four; or rows with lower and upper; got "
            f"{', '.join(known) or 'no field'}"
        )
    return _SETS[known](*(read_part(given, name, _READERS[name]) for name in known))


def _cut_box(lower: list[Any], upper: list[Any], H: Rows, h: Numbers) -> Polytope:
    rows, sides = Polytope.box(lower, upper).inequalities
    return Polytope.halfspaces(np.vstack([rows, H]), np.append(sides, h))


def fields_of(written: object, known: Iterable[str], required: Iterable[str] = ()) -> Mapping[str, Any]:
    """Return `written`. ValueError: it is no mapping, has a field that is not `known`, or lacks a `required` one."""
    if not isinstance(written, Mapping):
        raise ValueError(f"expected a mapping of {', '.join(known)}, got {short(written)}")
    if unknown := [str(name) for name in written if name not in known]:
        raise ValueError(f"has an unknown field {unknown[0]}; the fields are {', '.join(known)}")
    if missing := [name for name in required if name not in written]:
        raise ValueError(f"lacks the field {missing[0]}")
    return written


def read_part(written: Mapping[str, Any], name: str, read: Callable[[Any], T]) -> T:
    """Return what `read` makes of the field `name`. ValueError, which begins with the name: `read` refuses it."""
    try:
        return read(written[name])
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: {str(error).removeprefix('system: ').removeprefix('set: ')}") from error


def matrix(written: object) -> Rows:
    """Return the rows of a matrix, as tuples of numbers. ValueError: `written` is no list of rows of equal length."""
    rows = written if isinstance(written, list) and all(isinstance(row, list) for row in written) else None
    if rows is None or len({len(row) for row in rows}) != 1 or not all(is_number(v) for row in rows for v in row):
        raise ValueError(f"expected a matrix: a list of rows of numbers, all of one length, got {short(written)}")
    return tuple(tuple(float(v) for v in row) for row in rows)


def vector(written: object) -> Numbers:
    """Return the numbers of a list. ValueError: `written` is no list of numbers, or empty."""
    if not (isinstance(written, list) and written and all(map(is_number, written))):
        raise ValueError(f"expected a list of numbers, got {short(written)}")
    return tuple(float(v) for v in written)


def _bounds(written: object, free: float) -> list[Any]:
    """Return numbers, and mappings of bounds that move; `free` takes the place of None."""
    known = written if isinstance(written, list) else []
    if not known or not all(v is None or is_number(v) or isinstance(v, Mapping) for v in known):
        raise ValueError(
            f"expected a list of numbers (null if free, a mapping if it moves in time), got {short(written)}"
        )
    return [free if v is None else v for v in known]


_READERS: Mapping[str, Callable[[Any], Any]] = {
    "rows": matrix,
    "lower": partial(_bounds, free=-math.inf),
    "upper": partial(_bounds, free=math.inf),
    "H": matrix,
    "h": vector,
}
"""How each field of a set is read."""

_SETS: Mapping[tuple[str, ...], Callable[..., Polytope]] = {
    ("lower", "upper"): Polytope.box,
    ("H", "h"): Polytope.halfspaces,
    ("lower", "upper", "H", "h"): _cut_box,
    ("rows", "lower", "upper"): Polytope,
}
"""The fields that describe a set together, and the function that makes it of them."""
