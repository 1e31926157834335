"""The files of the command line: a system with its sets, in the form of params.yaml, and a table of rows."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from trackably.arguments import is_number
from trackably.arrays import Array
from trackably.errors import InputError
from trackably.files import from_json, read_bytes, read_yaml
from trackably.given.table import Table
from trackably.gp.samples import Samples
from trackably.recordings.clocks import POINT, parse, scale_once
from trackably.recordings.csv_file import CsvLayout, read_cells
from trackably.systems.constrained import ConstrainedSystem, System
from trackably.systems.library import model_of
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope, box_as_written
from trackably.systems.sampling import sampled_names

_PARTS = {"system", "state_set", "input_set"}
_LINEAR = {"A", "B", "c", "continuous", "states", "inputs", "sampling_time"}
_NAMED = {"model", "sampling_time", "parameters"}
_SET = {"lower", "upper", "H", "h", "rows"}


def read_plant(path: Path) -> ConstrainedSystem:
    """Return the plant in a file with `system`, `state_set` and `input_set`.

    A system is linear (A, B, c, continuous, states, inputs, sampling_time), or a `model` of the library by its name
    (sampling_time, parameters). A `continuous` system is sampled with its input held. A set is a box (lower, upper),
    the half-spaces H x ≤ h, or both; or sums `rows` of coordinates between lower and upper. null as a bound or a set
    means unbounded. Raises InputError with the file and what is wrong.
    """
    try:
        content = _fields(_content(path), "the file", _PARTS)
        if missing := sorted(_PARTS - content.keys()):
            raise ValueError(f"the file lacks {missing[0]}; null says that nothing is bounded")
        system = _system(content["system"])
        sides = (("state_set", len(system.states)), ("input_set", len(system.inputs)))
        return ConstrainedSystem(system, *(_read_set(content[name], name, size) for name, size in sides))
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: {error}") from error


def _content(path: Path) -> object:
    if path.suffix in (".yaml", ".yml"):
        return read_yaml(path)
    try:
        return from_json(read_bytes(path))
    except ValueError as error:
        raise ValueError(f"{error}; YAML is read from files named .yaml or .yml") from error


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


def _read_set(value: object, name: str, size: int) -> Polytope:
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
        if not isinstance(given[end], list) or not all(
            v is None or is_number(v) or isinstance(v, dict) for v in given[end]
        ):
            raise ValueError(f"{name}: {end} must be a list of numbers, with null for what is free, got {given[end]!r}")
    return box_as_written(given["lower"], given["upper"])


def _require(what: str, given: dict[str, Any], *fields: str) -> None:
    if missing := [field for field in fields if field not in given]:
        raise ValueError(f"{what} lacks {missing[0]}")


_STEPS, _TIMES = ("k", "step"), ("t", "time")
_LAYOUT = CsvLayout(missing=("",))
_OFF = 1e-6  # tolerance of times in a table of steps, in sampling times


@dataclass(frozen=True)
class Columns:
    """The columns of a file by their headings, without units in brackets; NaN for an empty cell.

    `places` name the rows, for example "line 2".
    """

    path: Path
    values: dict[str, Array]
    places: Sequence[str]

    def times(self, sampling_time: float) -> Array:
        """Return the times of the rows [s]. InputError: there is no column of steps or times."""
        for names, scale in ((_TIMES, 1.0), (_STEPS, sampling_time)):
            for name in names:
                if name in self.values:
                    return self.values[name] * scale
        raise InputError(f"{self.path}: expected a column k or step, or t or time; it has {', '.join(self.values)}")

    def table(self, plant: ConstrainedSystem) -> Table:
        """Return states and inputs at the steps. InputError: a column is missing, or a time is no step."""
        system = plant.system
        if missing := [name for name in (*system.states, *system.inputs) if name not in self.values]:
            raise InputError(
                f"{self.path}: there is no column {missing[0]}: a table at the steps needs all states and inputs; give "
                "an interpolation for curves of some states"
            )
        steps = self.times(plant.sampling_time) / plant.sampling_time
        whole = np.round(steps)
        follows = np.append(True, np.diff(whole) == 1)
        if wrong := np.flatnonzero(~((np.abs(steps - whole) <= _OFF) & follows)).tolist():
            i = wrong[0]
            before = f" after {steps[i - 1]:.9g}" if i else ""
            raise InputError(
                f"{self.path}: {self.places[i]}: rows must be successive steps, k or t = k T with "
                f"T = {plant.sampling_time:g} s, got the step {steps[i]:.9g}{before}"
            )
        states, inputs = (
            np.stack([self.values[name] for name in names], axis=1) for names in (system.states, system.inputs)
        )
        if len(inputs) > 1 and np.all(np.isnan(inputs[-1])):
            inputs = inputs[:-1]
        try:
            return Table(states, inputs, int(whole[0]))
        except ValueError as error:
            raise InputError(f"{self.path}: {error}") from error

    def samples(self, plant: ConstrainedSystem) -> dict[str, Samples]:
        """Return samples of the flat outputs, by state, from the columns of the file. InputError: there are none."""
        shown = [sampled_names(plant, signal) for signal in range(plant.signal_count)]
        found = [name for names in shown if (name := next((name for name in names if name in self.values), None))]
        times = self.times(plant.sampling_time)
        if not found:
            wanted = " or ".join(name for names in shown for name in names)
            raise InputError(
                f"{self.path}: no column shows a flat output; expected {wanted}, got {', '.join(self.values)}"
            )
        try:
            return {name: Samples(times, self.values[name]) for name in found}
        except ValueError as error:
            raise InputError(f"{self.path}: {error}") from error


def read_columns(path: Path) -> Columns:
    """Read a CSV file with a header, with commas, semicolons or tabs between cells.

    InputError says what is wrong in it.
    """
    cells = read_cells(path, _LAYOUT)
    rows = zip(*cells.columns.values(), strict=True)
    cells = cells.part([i for i, row in enumerate(rows) if not all(map(_LAYOUT.is_missing, row))])
    if (count := len(cells.places)) < 2:
        raise InputError(f"{path}: expected a header and two rows at least, got {count} rows that are not empty")
    heads = [head.partition("[")[0].strip() for head in cells.columns]
    if twice := [head for i, head in enumerate(heads) if head in heads[:i]]:
        raise InputError(f"{path}: expected a header of different names, but {twice[0]!r} is there twice")
    values = [
        [_number(path, *of) for of in zip(cells.places, cells.columns[name], strict=True)] for name in cells.columns
    ]
    return Columns(path, dict(zip(heads, map(np.array, values), strict=True)), cells.places)


def _number(path: Path, place: str, cell: str) -> float:
    try:
        return float("nan") if _LAYOUT.is_missing(cell) else scale_once(parse(cell, POINT), 1.0)
    except ValueError as error:
        raise InputError(f"{path}, {place}: {error}") from None
