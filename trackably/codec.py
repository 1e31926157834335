"""Convert the library's frozen dataclasses to JSON and back, losslessly: every float64 returns bit for bit.

Reading is strict. An object has exactly the fields of its class, and nothing is converted: strings and truth values are
no numbers, and NaN and infinities are refused. The name of a kernel in the registry is the field `type`, a formula is
nested lists, and a system with the field f is nonlinear.
"""

import dataclasses
import re
import sys
from collections.abc import Callable, Set
from fractions import Fraction
from functools import cache
from reprlib import repr as short
from types import GenericAlias
from typing import Any, TypeVar, get_args, get_origin

import numpy as np
from cattrs import BaseValidationError, Converter, StructureHandlerNotFoundError, transform_error
from cattrs.cols import is_frozenset
from cattrs.gen import make_dict_structure_fn, make_dict_unstructure_fn

from trackably.arrays import Array
from trackably.checker.form import a_formula
from trackably.checker.formulas import Formula
from trackably.files import LEFT_OUT, from_json, to_json
from trackably.gp.hyperparameter import Hyperparameter, Learned
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.registry import KERNELS, name_of
from trackably.gp.signal import KernelSum
from trackably.gp.stencil import Stencil, Stencils
from trackably.systems.constrained import System
from trackably.systems.disturbances import ConvexHull, DisturbanceSet, Zonotope
from trackably.systems.formulas import to_lists
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.pieces import PolynomialPieces, Signal
from trackably.systems.polytopes import Polytope

# A hyperparameter as JSON: a number is known; an object with `learned` and `interval` is learned.


def read_hyperparameter(data: Any, _: Any) -> float:
    """Read a hyperparameter: a float, with its interval if it is learned. CodecError: `data` is anything else."""
    if not isinstance(data, dict):
        return read_float(data, float)
    if data.keys() != {"learned", "interval"}:
        raise CodecError(f"a learned hyperparameter must be an object with learned and interval, got {short(data)}")
    value, interval = read_float(data["learned"], float), data["interval"]
    if interval is None:
        return Learned(value)
    if not isinstance(interval, list) or len(interval) != 2:
        raise CodecError(f"the interval of a hyperparameter must be two numbers, got {short(interval)}")
    return Learned(value, (read_float(interval[0], float), read_float(interval[1], float)))


def write_hyperparameter(value: float) -> Any:
    """Return the JSON of a hyperparameter."""
    if not isinstance(value, Learned):
        return float(value)
    return {"learned": float(value), "interval": list(value.interval) if value.interval else None}


# Numbers and arrays from JSON, read strictly.


class CodecError(ValueError):
    """A value cannot be written as JSON, or JSON cannot be read as a value; the message says where ($ is the root)."""


def read_float(value: Any, _: Any) -> float:
    """Return a finite number that float64 holds exactly. CodecError: `value` is anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise CodecError(f"must be a number, got {short(value)}")
    if not (abs(value) <= sys.float_info.max and float(value) == value):
        raise CodecError(f"must be finite, and exact in float64, got {short(value)}")
    return float(value)


def read_fraction(value: Any, _: Any) -> Fraction:
    """Return the rational number of a text such as -3/4. CodecError: `value` is anything else."""
    if not isinstance(value, str) or not re.fullmatch(r"-?[0-9]+(/0*[1-9][0-9]*)?", value):
        raise CodecError(f"must be a rational number such as -3/4, got {short(value)}")
    return Fraction(value)


def read_array(values: Any, _: Any) -> Array:
    """Return nested lists of numbers as an array. CodecError: `values` are anything else, or lists differ in length."""
    if not isinstance(values, list):
        raise CodecError(f"must be a list of numbers, got {short(values)}")
    items: list[Any] = []
    for i, value in enumerate(values):
        try:
            items.append(read_array(value, float) if isinstance(value, list) else read_float(value, float))
        except CodecError as error:
            raise CodecError(f"[{i}] {error}") from error
    if len({np.shape(item) for item in items}) > 1:
        raise CodecError(f"must be lists of one length, got {short(values)}")
    return np.array(items, dtype=float)


_MAY_BE_MISSING = {"flat", "angles", "positive", "scatters"}  # fields of systems and samples, left out by default

T = TypeVar("T")
Hook = Callable[[Any, Any], Any]


def encode(value: object) -> Any:
    """Return a dataclass as nested dicts, lists, strings and numbers, which `decode` reads.

    CodecError: it has no JSON.
    """
    if isinstance(value, type) or not dataclasses.is_dataclass(value):
        raise CodecError(f"only a dataclass has a JSON here, got {short(value)}")
    data = encode_unverified(value)
    decode(type(value), data)
    return data


def encode_unverified(value: object) -> Any:
    """Return the same as `encode`, but do not verify that `decode` reads it.

    For certificates, which the checker reads.
    """
    return _CONVERTER.unstructure(value)


def decode(wanted: type[T], data: object) -> T:
    """Return the value of type `wanted` whose `encode` is `data`. CodecError: there is none."""
    try:
        value = _CONVERTER.structure(data, wanted)
    except (CodecError, BaseValidationError, StructureHandlerNotFoundError) as error:
        raise CodecError(f"{_name(wanted)}: {'; '.join(transform_error(error, '$', _sentence))}") from error
    # The library takes any iterable for a list, say; writing the value again shows whether it was read as it stands.
    if where := _difference(_CONVERTER.unstructure(value, unstructure_as=wanted), data, "$"):
        raise CodecError(f"{_name(wanted)}: not written as a value of its type would be @ {where}")
    return value


def dumps(value: object) -> bytes:
    """Return the JSON file's content for `encode(value)`."""
    return to_json(encode(value))


def loads(wanted: type[T], data: bytes) -> T:
    """Return `decode` of a JSON file's content. CodecError: `data` is not strict JSON, or not of the type `wanted`."""
    try:
        content = from_json(data)
    except ValueError as error:
        raise CodecError(f"{_name(wanted)}: {error}") from error
    return decode(wanted, content)


def _name(wanted: Any) -> str:
    return wanted.__name__ if isinstance(wanted, type) else str(wanted)


def _sentence(error: BaseException, _: object) -> str:
    return str(error) or type(error).__name__


def _difference(written: object, data: object, path: str) -> str | None:
    """Return the path at which two JSON values first differ; an int equals the float of the same value."""
    if isinstance(written, dict) and isinstance(data, dict) and written.keys() == data.keys():
        inner = ((f"{path}.{key}", written[key], data[key]) for key in written)
    elif isinstance(written, list) and isinstance(data, list) and len(written) == len(data):
        inner = ((f"{path}[{i}]", a, b) for i, (a, b) in enumerate(zip(written, data, strict=True)))
    else:
        return None if written == data else path
    return next((found for where, a, b in inner if (found := _difference(a, b, where))), None)


@cache
def _read_object(cls: type) -> Hook:
    """Return a reader of JSON objects that have every field of `cls`, with defaults or not, and no other.

    Only fields that are left out by default may be missing.
    """
    read: Hook = make_dict_structure_fn(cls, _CONVERTER)
    names = [field.name for field in dataclasses.fields(cls)]
    needed = [field.name for field in dataclasses.fields(cls) if not _is_left_out(field)]

    def hook(data: Any, _: Any) -> Any:
        if not isinstance(data, dict):
            raise CodecError(f"{cls.__name__} must be an object, got {short(data)}")
        if missing := [name for name in needed if name not in data]:
            raise CodecError(f"{cls.__name__} lacks {', '.join(missing)}")
        if unknown := [str(name) for name in data if name not in names]:
            raise CodecError(f"{cls.__name__} has no {', '.join(unknown)}")
        return read(data, cls)

    return hook


def _is_left_out(field: dataclasses.Field[Any]) -> bool:
    """Whether a field with its default value is not written."""
    return bool(field.metadata.get(LEFT_OUT)) or field.name in _MAY_BE_MISSING


def _leaves_out(cls: Any) -> bool:
    return dataclasses.is_dataclass(cls) and any(map(_is_left_out, dataclasses.fields(cls)))


def _write_object(cls: type) -> Callable[[Any], dict[str, Any]]:
    write: Callable[[Any], dict[str, Any]] = make_dict_unstructure_fn(cls, _CONVERTER)
    default = {field.name: field.default for field in dataclasses.fields(cls) if _is_left_out(field)}

    def hook(value: Any) -> dict[str, Any]:
        return {
            name: data
            for name, data in write(value).items()
            if name not in default or getattr(value, name) is not default[name]
        }

    return hook


def _read_kernel(data: Any, wanted: type[Kernel]) -> Any:
    if not isinstance(data, dict) or "type" not in data:
        raise CodecError(f"a kernel must be an object with a type, got {short(data)}")
    kernel = KERNELS.get(data["type"]) if isinstance(data["type"], str) else None
    if kernel is None or not issubclass(kernel, wanted):
        known = ", ".join(name for name, cls in KERNELS.items() if issubclass(cls, wanted))
        raise CodecError(f"the type of this kernel must be one of {known}, got {short(data['type'])}")
    return _read_object(kernel)({name: value for name, value in data.items() if name != "type"}, kernel)


def _write_kernel(kernel: Kernel) -> dict[str, Any]:
    try:
        name = name_of(type(kernel))
    except ValueError as error:
        raise CodecError(str(error)) from error
    return {"type": name, **_kernel_fields(type(kernel))(kernel)}


@cache
def _kernel_fields(cls: type[Kernel]) -> Callable[[Kernel], dict[str, Any]]:
    return make_dict_unstructure_fn(cls, _CONVERTER)


def _read_either(telltale: str, with_it: type, without: type, optional: bool = False) -> Hook:
    """Return a reader of two classes: `with_it` if the object has the field `telltale`, else `without`.

    If the value is `optional`, null is read as None.
    """

    def hook(data: Any, _: Any) -> Any:
        if data is None and optional:
            return None
        return _CONVERTER.structure(data, with_it if isinstance(data, dict) and telltale in data else without)

    return hook


def _write_set(bounded: Polytope) -> dict[str, Any]:
    """Write a set; an end that moves in time is an object instead of a number."""
    low, high = (_CONVERTER.unstructure(of) for of in bounded.ends)
    return {"rows": bounded.rows.tolist(), "lower": low, "upper": high, "dimension": bounded.dimension}


def _read_set_of_points(data: Any, _: Any) -> Polytope:
    """Read a set; ends that move in time are objects instead of numbers."""
    fields = {"rows", "lower", "upper", "dimension"}
    if not isinstance(data, dict) or data.keys() != fields or not any(isinstance(end, dict) for end in _ends(data)):
        found: Polytope = _read_object(Polytope)(data, Polytope)
        return found
    low, high = (
        [_CONVERTER.structure(end, PolynomialPieces if isinstance(end, dict) else float) for end in data[side]]
        for side in ("lower", "upper")
    )
    return Polytope(read_array(data["rows"], float), low, high, _CONVERTER.structure(data["dimension"], int))


def _ends(data: dict[str, Any]) -> list[Any]:
    return [end for side in ("lower", "upper") if isinstance(data[side], list) for end in data[side]]


def _read_formula(data: Any, _: Any) -> Formula:
    try:
        return a_formula(data, "a formula")
    except ValueError as error:
        raise CodecError(str(error)) from error


def _read_set(values: Any, wanted: Any) -> frozenset[Any]:
    if not isinstance(values, list):  # else the letters of a text would do
        raise CodecError(f"must be a list, got {short(values)}")
    items: Any = GenericAlias(list, get_args(wanted))
    return frozenset(_CONVERTER.structure(values, items))


def _read_exactly(cls: type) -> Hook:
    """Return a reader of values of exactly this class: True, say, is no int."""

    def hook(value: Any, _: Any) -> Any:
        if type(value) is not cls:
            raise CodecError(f"must be of type {cls.__name__}, got {short(value)}")
        return value

    return hook


def _is_array(cls: Any) -> bool:
    return cls is np.ndarray or get_origin(cls) is np.ndarray


def _is_formula(cls: Any) -> bool:
    return cls == Formula or cls in get_args(Formula)


def _is_kernel(cls: Any) -> bool:
    return isinstance(cls, type) and issubclass(cls, Kernel)


def _converter() -> Converter:
    converter = Converter(unstruct_collection_overrides={tuple: list, Set: sorted})
    for cls in (bool, int, str):
        converter.register_structure_hook(cls, _read_exactly(cls))
    converter.register_structure_hook(float, read_float)
    converter.register_unstructure_hook(float, lambda value: float(value) if isinstance(value, float) else value)
    converter.register_structure_hook(Hyperparameter, read_hyperparameter)
    converter.register_unstructure_hook(Hyperparameter, write_hyperparameter)
    converter.register_structure_hook_func(_is_array, read_array)
    converter.register_unstructure_hook_func(_is_array, lambda array: array.tolist())
    converter.register_structure_hook_func(is_frozenset, _read_set)
    system, signal = (
        _read_either("f", NonlinearSystem, LinearSystem),
        _read_either("breakpoints", PolynomialPieces, KernelSum),
    )
    converter.register_structure_hook_func(lambda cls: cls == System, system)
    converter.register_structure_hook_func(lambda cls: cls == Signal, signal)
    converter.register_structure_hook_func(
        lambda cls: cls == Stencil | Stencils, _read_either("parts", Stencils, Stencil)
    )
    disturbance = _read_either("vertices", ConvexHull, Zonotope, optional=True)
    converter.register_structure_hook_func(lambda cls: cls == DisturbanceSet | None, disturbance)
    converter.register_structure_hook(Polytope, _read_set_of_points)
    converter.register_unstructure_hook(Polytope, _write_set)
    converter.register_structure_hook(Fraction, read_fraction)
    converter.register_unstructure_hook(Fraction, str)
    converter.register_structure_hook_factory(dataclasses.is_dataclass, _read_object)
    converter.register_unstructure_hook_factory(_leaves_out, _write_object)
    converter.register_structure_hook_func(_is_kernel, _read_kernel)
    converter.register_unstructure_hook_func(_is_kernel, _write_kernel)
    converter.register_structure_hook_func(_is_formula, _read_formula)
    converter.register_unstructure_hook_func(_is_formula, to_lists)
    return converter


_CONVERTER = _converter()
