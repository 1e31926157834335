"""Tables of steps or times, states and inputs in CSV files."""

import csv
from dataclasses import dataclass
from io import StringIO
from math import isfinite
from pathlib import Path
from reprlib import repr as short

import numpy as np

from trackably.arrays import Array
from trackably.errors import InputError
from trackably.files import read_bytes
from trackably.given.table import Table
from trackably.gp.samples import Samples
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.sampling import shows_level

_STEPS, _TIMES = ("k", "step"), ("t", "time")
_OFF = 1e-6  # of a sampling time: times in a table of steps may be off by so much


@dataclass(frozen=True)
class Columns:
    """The columns of a file by the names of their heads, without units in brackets; NaN where a cell is empty.

    `lines` are the numbers of the rows' lines.
    """

    path: Path
    values: dict[str, Array]
    lines: tuple[int, ...]

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
                f"{self.path}: line {self.lines[i]}: rows must be successive steps, k or t = k T with "
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
        """Return samples of the flat outputs, by state, from the columns that there are. InputError: there are none."""
        flat = [f"z{i + 1}" for i in range(plant.signal_count)]
        named = [name for name in (*plant.system.states, *flat) if name in self.values]
        seen: dict[int, str] = {}
        for name in named:
            at = flat.index(name) if name in flat else _shown(plant, name)
            if at is not None:
                seen.setdefault(at, name)
        times = self.times(plant.sampling_time)
        if not seen:
            shown = [name for name in plant.system.states if _shown(plant, name) is not None]
            raise InputError(
                f"{self.path}: no column shows a flat output; expected {' or '.join([*shown, *flat])}, got "
                f"{', '.join(self.values)}"
            )
        try:
            return {name: Samples(times, self.values[name]) for name in seen.values()}
        except ValueError as error:
            raise InputError(f"{self.path}: {error}") from error


def _shown(plant: ConstrainedSystem, name: str) -> int | None:
    """Return the flat output that a state shows with its level; None where it shows none, or several."""
    seen = plant.flatness.states[plant.system.states.index(name)].stencil
    return seen[0] if seen is not None and shows_level(seen[1]) else None


def read_columns(path: Path) -> Columns:
    """Read a CSV file with a header: commas, semicolons or tabs between cells. InputError says what is wrong in it."""
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: cannot be read ({error})") from error
    lines = _lines(path, text)
    if len(lines) < 3:
        raise InputError(f"{path}: expected a header and two rows at least, got {len(lines)} lines that are not empty")
    heads = [head.partition("[")[0].strip() for head in lines[0][1]]
    if twice := [head for i, head in enumerate(heads) if head in heads[:i]]:
        raise InputError(f"{path}: expected a header of different names, but {twice[0]!r} is there twice")
    values = [_numbers(path, line, row, len(heads)) for line, row in lines[1:]]
    return Columns(path, dict(zip(heads, np.array(values).T, strict=True)), tuple(line for line, _ in lines[1:]))


def _lines(path: Path, text: str) -> list[tuple[int, list[str]]]:
    """Return the cells of the lines that are not empty, each with the number at which it ends."""
    header = text.lstrip().partition("\n")[0]
    reader = csv.reader(StringIO(text, newline=""), delimiter=max(",;\t", key=header.count))
    try:
        return [(reader.line_num, row) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num}: is not CSV: {error}") from error


def _numbers(path: Path, line: int, row: list[str], count: int) -> list[float]:
    if len(row) != count:
        raise InputError(f"{path}: line {line}: expected {count} cells, got {len(row)}")
    found = []
    for cell in row:
        try:
            number = float(cell) if cell.strip() else float("nan")
        except ValueError:
            raise InputError(f"{path}: line {line}: expected a number, got {short(cell)}") from None
        if cell.strip() and not isfinite(number):
            raise InputError(f"{path}: line {line}: expected a finite number, got {short(cell)}")
        found.append(number)
    return found
