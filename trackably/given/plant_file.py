"""A system with its sets in a file, JSON or YAML, as entries of params.yaml write them."""

from pathlib import Path
from typing import Any

import numpy as np

from trackably.arguments import is_number
from trackably.errors import InputError
from trackably.files import from_json, from_yaml, read_bytes
from trackably.systems.constrained import ConstrainedSystem, System
from trackably.systems.library import model_of
from trackably.systems.linear import LinearSystem
from trackably.systems.sets.polytope import Polytope

_PARTS = {"system", "state_set", "input_set"}
_LINEAR = {"A", "B", "c", "continuous", "states", "inputs", "sampling_time"}
_NAMED = {"model", "sampling_time", "parameters"}
_SET = {"lower", "upper", "H", "h", "rows"}


def read_plant(path: Path) -> ConstrainedSystem:
    """Return what a file says: `system`, `state_set`, `input_set`.

    A system is linear (A, B, c, continuous, states, inputs, sampling_time), or a `model` of the library by its name
    (sampling_time, parameters). One that is `continuous` is sampled with its input held. A set is a box (lower, upper),
    the half-spaces H x ≤ h, or both; or the sums `rows` of coordinates between lower and upper. Bounds that are null
    are none, and so is a set that is null. Raises InputError with the file and what is wrong.
    """
    try:
        content = _fields(_content(path), "the file", _PARTS)
        if missing := sorted(_PARTS - content.keys()):
            raise ValueError(f"the file lacks {missing[0]}; null says that nothing is bounded")
        system = _system(content["system"])
        sides = (("state_set", len(system.states)), ("input_set", len(system.inputs)))
        return ConstrainedSystem(system, *(_set(content[name], name, size) for name, size in sides))
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: {error}") from error


def _content(path: Path) -> object:
    data = read_bytes(path)
    if path.suffix not in (".yaml", ".yml"):
        try:
            return from_json(data)
        except ValueError as error:
            raise ValueError(f"{error}; YAML is read from files named .yaml or .yml") from error
    try:
        return from_yaml(data)
    except ModuleNotFoundError:
        raise InputError(f"{path}: YAML is read with ruamel.yaml: pip install ruamel.yaml, or write JSON") from None


def _fields(value: object, what: str, known: set[str]) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{what} must be a mapping of {', '.join(sorted(known))}")
    if unknown := [str(name) for name in value if name not in known]:
        raise ValueError(f"{what} has no field {unknown[0]}; there are {', '.join(sorted(known))}")
    return value


def _system(value: object) -> System:
    if isinstance(value, dict) and "model" in value:
        named = _fields(value, "system", _NAMED)
        _require("system", named, "sampling_time")
        if not isinstance(parameters := named.get("parameters", {}), dict):
            raise ValueError("system: parameters must be a mapping from names to numbers")
        return model_of(str(named["model"]), named["sampling_time"], parameters)
    given = _fields(value, "system", _LINEAR)
    _require("system", given, "A", "B", "sampling_time")
    if not isinstance(continuous := given.get("continuous", False), bool):
        raise ValueError(f"system: continuous must be true or false, got {continuous!r}")
    rest = {name: given[name] for name in ("c", "states", "inputs") if name in given}
    make = LinearSystem.discretised if continuous else LinearSystem
    return make(given["A"], given["B"], sampling_time=given["sampling_time"], **rest)


def _set(value: object, name: str, size: int) -> Polytope:
    if value is None:
        return Polytope([], [], [], size)
    given = _fields(value, name, _SET)
    try:
        return _polytope(given, name, size)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}{str(error).removeprefix('set').removeprefix(name)}") from error


def _polytope(given: dict[str, Any], name: str, size: int) -> Polytope:
    if "rows" in given:
        _require(name, given, "lower", "upper")
        return Polytope(given["rows"], given["lower"], given["upper"], size)
    if "H" not in given and "h" not in given:
        return _box(given, name)
    _require(name, given, "H", "h")
    if "lower" not in given and "upper" not in given:
        return Polytope.halfspaces(given["H"], given["h"])
    H, h = _box(given, name).inequalities
    return Polytope.halfspaces(np.vstack([H, given["H"]]), np.concatenate([h, given["h"]]))


def _box(given: dict[str, Any], name: str) -> Polytope:
    _require(name, given, "lower", "upper")
    for end in ("lower", "upper"):
        if not isinstance(given[end], list) or not all(v is None or is_number(v) for v in given[end]):
            raise ValueError(f"{name}: {end} must be a list of numbers, with null for what is free, got {given[end]!r}")
    infinite = float("inf")
    lower = [-infinite if v is None else v for v in given["lower"]]
    return Polytope.box(lower, [infinite if v is None else v for v in given["upper"]])


def _require(what: str, given: dict[str, Any], *fields: str) -> None:
    if missing := [field for field in fields if field not in given]:
        raise ValueError(f"{what} lacks {missing[0]}")
