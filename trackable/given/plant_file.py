"""A system with its sets in a file, JSON or YAML, as entries of params.yaml write them."""

from pathlib import Path
from typing import Any

from trackable.errors import InputError
from trackable.files import from_json, read_bytes
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.linear import LinearSystem
from trackable.systems.sets.polytope import Polytope

_SYSTEM = {"A", "B", "c", "continuous", "states", "inputs", "sampling_time"}
_SET = {"rows", "lower", "upper"}


def read_plant(path: Path) -> ConstrainedSystem:
    """Return what a file says: `system` (A, B, c, continuous, states, inputs, sampling_time), `state_set`, `input_set`.

    A set is {lower, upper} of the coordinates, or {rows, lower, upper} of sums of them; bounds that are null are none.
    A system that is `continuous` is sampled with its input held. Raises InputError with the file and what is wrong.
    """
    try:
        content = _fields(_content(path), "the file", {"system", "state_set", "input_set"})
        system = _system(_fields(content.get("system"), "system", _SYSTEM))
        sides = (("state_set", len(system.states)), ("input_set", len(system.inputs)))
        return ConstrainedSystem(system, *(_set(content.get(name), name, size) for name, size in sides))
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: {error}") from error


def _content(path: Path) -> object:
    data = read_bytes(path)
    if path.suffix not in (".yaml", ".yml"):
        return from_json(data)
    try:
        from ruamel.yaml import YAML  # noqa: PLC0415  an extra
        from ruamel.yaml.error import YAMLError  # noqa: PLC0415
    except ModuleNotFoundError:
        raise InputError(f"{path}: YAML is read with ruamel.yaml: pip install ruamel.yaml, or write JSON") from None
    try:
        content: object = YAML(typ="safe", pure=True).load(data.decode())
    except YAMLError as error:
        raise ValueError(f"is not YAML: {' '.join(str(error).split())}") from error
    return content


def _fields(value: object, what: str, known: set[str]) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{what} must be a mapping of {', '.join(sorted(known))}")
    if unknown := [str(name) for name in value if name not in known]:
        raise ValueError(f"{what} has no field {unknown[0]}; there are {', '.join(sorted(known))}")
    return value


def _system(given: dict[str, Any]) -> LinearSystem:
    if missing := [name for name in ("A", "B", "sampling_time") if name not in given]:
        raise ValueError(f"system lacks {missing[0]}")
    rest = {name: given[name] for name in ("c", "states", "inputs") if name in given}
    make = LinearSystem.discretised if given.get("continuous", False) else LinearSystem
    return make(given["A"], given["B"], sampling_time=given["sampling_time"], **rest)


def _set(value: object, name: str, size: int) -> Polytope:
    if value is None:
        return Polytope([], [], [], size)
    given = _fields(value, name, _SET)
    if missing := [end for end in ("lower", "upper") if end not in given]:
        raise ValueError(f"{name} lacks {missing[0]}")
    if "rows" in given:
        return Polytope(given["rows"], given["lower"], given["upper"], size)
    infinite = float("inf")
    lower, upper = (
        [none if v is None else v for v in given[end]]
        for end, none in zip(("lower", "upper"), (-infinite, infinite), strict=True)
    )
    return Polytope.box(lower, upper)
