"""Read systems and sets from the mappings in files: params.yaml, and files for the command line.

Each ValueError begins with the name of the wrong field.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from reprlib import repr as short
from typing import Any, TypeVar

import numpy as np

from trackably.arguments import numbers
from trackably.arrays import ArrayLike
from trackably.systems.constrained import System
from trackably.systems.library import model_of
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Ends, Polytope

T = TypeVar("T")

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
    given = {**fields_of(written, _LINEAR, ["A", "B", "sampling_time"])}
    if not isinstance(continuous := given.pop("continuous", False), bool):
        raise ValueError(f"continuous: expected true or false, got {short(continuous)}")
    matrices = {name: objects(given[name]) for name in "ABc" if given.get(name) is not None}
    return (LinearSystem.discretised if continuous else LinearSystem)(**given | matrices)


def set_of(written: object) -> Polytope:
    """Return the set that a mapping describes.

    It is a box (`lower`, `upper`), the half-spaces `H` x ≤ `h`, or the intersection of both; or, with `rows`, the set
    `lower` ≤ `rows` x ≤ `upper`. A coordinate of a box is free where both of its bounds are null. A bound that moves
    in time is a mapping, as `PolynomialPieces.from_mapping` reads it.

    ValueError or TypeError: `written` describes no set.
    """
    given = fields_of(written, _PARTS)
    known = tuple(name for name in _PARTS if name in given)
    if known not in _SETS:
        raise ValueError(
            "expected lower with upper, H with h, or all four; or rows with lower and upper; got "
            f"{', '.join(known) or 'no field'}"
        )
    return _SETS[known](*(_ends(name, given[name]) if name in _FREE else objects(given[name]) for name in known))


def _ends(name: str, written: Any) -> Any:
    """Return the lower or the upper ends of a set (`name` says which), where null stands for an infinite one."""
    if not isinstance(written, list):
        raise ValueError(f"{name}: expected a list of numbers, of null (free) and of mappings, got {short(written)}")
    return objects([_FREE[name] if end is None else end for end in written])


def objects(written: Any) -> Any:
    """Return the values in a file as an array of objects, so that true stays true, and is not taken for 1.

    Lists of different lengths are returned unchanged.
    """
    found = np.array(written, dtype=object)
    return written if any(isinstance(entry, list) for entry in found.flat) else found


def _cut_box(lower: Ends, upper: Ends, H: ArrayLike, h: ArrayLike) -> Polytope:
    rows, sides = Polytope.box(lower, upper).inequalities
    return Polytope.halfspaces(np.vstack([rows, numbers("set: H", H)]), np.append(sides, numbers("set: h", h)))


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


_FREE = {"lower": -math.inf, "upper": math.inf}
_PARTS = ("rows", "lower", "upper", "H", "h")
_SETS: Mapping[tuple[str, ...], Callable[..., Polytope]] = {
    ("lower", "upper"): Polytope.box,
    ("H", "h"): Polytope.halfspaces,
    ("lower", "upper", "H", "h"): _cut_box,
    ("rows", "lower", "upper"): Polytope,
}
"""The fields that describe a set together, and the function that makes it of them."""
