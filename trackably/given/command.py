"""The command `python -m trackably certify TABLE --system FILE`: what it reads, what it prints, and its exit code.

FILE has a system and its sets as `system`, `state_set` and `input_set`; TABLE has a row for each step or time.
"""

import re
from argparse import Namespace
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from trackably.arrays import Array
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.errors import InputError
from trackably.files import errors_of, from_json, read_bytes, read_yaml, unwritable
from trackably.given.table import CertifiedTable, RefutedTable, Table, certify_table
from trackably.gp.samples import Samples
from trackably.progress import progress_bar
from trackably.recordings import tables
from trackably.recordings.clocks import CLOCKS, Ticks
from trackably.recordings.csv_file import CsvLayout, csv_table
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.sampling import sampled_names
from trackably.systems.written import fields_of, read_part, set_of, system_of

if TYPE_CHECKING:
    from trackably.given.certify import CertifiedReference

PROVED, REFUTED, UNDECIDED = 0, 1, 3


Answer: TypeAlias = "CertifiedReference | CertifiedTable | Counterexample | RefutedTable | Unproved"


def run(given: Namespace) -> int:
    """Print the answer, save it if asked to, and return the exit code.

    InputError or ValueError: a file cannot be read or written, or does not fit.
    """
    plant = read_plant(given.system)
    with progress_bar("certify"):
        answer = _answer(given, plant)
    print(answer.explanation)
    code, save = _code_and_save(answer)
    if given.save:
        try:
            save(given.save)
        except OSError as error:
            raise InputError(f"--save: {unwritable(error)}") from error
    return code


def _answer(given: Namespace, plant: ConstrainedSystem) -> Answer:
    if given.claim and not given.interpolation:
        raise InputError("--claim: expected an --interpolation too, as rows alone say nothing about other times")
    names = (*plant.system.states, *plant.system.inputs)
    columns = read_columns(given.table, given.decimal, names)
    columns = replace(columns, scales=read_scales(given.scale, names), time=given.time)
    with errors_of(given.table):
        wanted = columns.samples(plant) if given.interpolation else columns.table(plant)
    if isinstance(wanted, Table):
        return certify_table(wanted, plant, given.tolerance)
    from trackably.given.certify import certify  # noqa: PLC0415  takes longer to load than all that was read so far

    return certify(wanted, plant, given.claim, given.interpolation)


def read_scales(written: Sequence[str], names: Collection[str]) -> dict[str, float]:
    """Return factors by the names of states and inputs, each written as NAME=FACTOR.

    InputError: a name is none of `names`, or is there twice; or a factor is not a finite number other than zero.
    """
    found = dict[str, float]()
    for each in written:
        name, _, factor = each.rpartition("=")
        if name not in names:
            raise InputError(f"--scale {each}: expected NAME=FACTOR, where NAME is one of {', '.join(names)}")
        if name in found:
            raise InputError(f"--scale {each}: expected one factor for each name, got another for {name} before")
        try:
            found[name] = tables.Column(name, float(factor)).scale
        except ValueError:
            raise InputError(
                f"--scale {each}: expected a finite number other than zero as FACTOR, got {factor!r}"
            ) from None
    return found


def _code_and_save(answer: Answer) -> tuple[int, Callable[[Path], object]]:
    """Return the exit code, and a function that writes the proof or the counterexample to a path, if there is one."""
    match answer:
        case RefutedTable() | Counterexample():
            return REFUTED, answer.save_counterexample
        case Unproved():
            return UNDECIDED, lambda _: None
        case _:
            return PROVED, answer.save_certificate


_PARTS = ("system", "state_set", "input_set")


def read_plant(path: Path) -> ConstrainedSystem:
    """Return the plant in a file with `system`, `state_set` and `input_set`, in the forms that `systems.written` reads.

    null as a set means unbounded. Raises InputError with the file and what is wrong.
    """
    with errors_of(path):
        content = fields_of(_content(path), _PARTS)
        if missing := [name for name in _PARTS if name not in content]:
            raise ValueError(f"expected {', '.join(_PARTS)}, got no {missing[0]} (null is a set without bounds)")
        system = read_part(content, "system", system_of)
        sides = (("state_set", len(system.states)), ("input_set", len(system.inputs)))
        sets = (
            Polytope([], [], [], size) if content[name] is None else read_part(content, name, set_of)
            for name, size in sides
        )
        return ConstrainedSystem(system, *sets)


def _content(path: Path) -> object:
    if path.suffix in (".yaml", ".yml"):
        return read_yaml(path)
    try:
        return from_json(read_bytes(path))
    except ValueError as error:
        raise ValueError(f"{error}; YAML is read from files named .yaml or .yml") from error


_TIMES, _STEPS = ("t", "time"), ("k", "step")
_LENGTHS = {name: float(unit.length) for name, unit in CLOCKS.items() if isinstance(unit, Ticks)}
_LENGTHS |= dict.fromkeys(("sec", "seconds", ""), 1.0)
_HEADING = re.compile(r"([^\[(]+?)\s*(?:[\[(](.*)[\])])?")
_WITHOUT_PREFIX = re.compile(r"(?:m|rad|s|kg|A|K|mol|N|Nm|J|W|Pa|Hz|V|C|F|H|T|Ω|1|-|–)(?:\^?-?\d|⁻?[¹²³])?")
"""A unit of SI without a prefix, which multiplies by no factor, and its power: a part of a unit such as m/s^2."""

_OFF = 1e-6  # in sampling times: a row may be this far from a whole step


@dataclass(frozen=True)
class Columns:
    """The columns of a file: its `cells`, and in `headings` the heading and the unit of each column, by name.

    The heading "x [mm]" has the name "x" and the unit "mm".

    `scales` are factors by the names of states and inputs, which convert their numbers to the units of the system.
    `time` names the column of times, with or without its unit; by default, it is a column k, step, t or time.
    """

    cells: tables.Table
    headings: Mapping[str, tuple[str, str]]
    scales: Mapping[str, float] = field(default_factory=dict)
    time: str | None = None

    def __getitem__(self, name: str) -> Array:
        """Return the numbers of a state or an input in the unit of the system, NaN for an empty cell.

        InputError: a cell is no number. ValueError: without a scale, the unit in the heading has a prefix or is not of
        SI, such as mm or deg, so that the numbers may be in another unit than those of the system.
        """
        heading, unit = self.headings[name]
        if name not in self.scales and not all(map(_WITHOUT_PREFIX.fullmatch, re.split(r"[\s*·/]+", unit or "1"))):
            raise ValueError(
                f"column {heading!r}: the system's file names no units, so numbers are read in SI units without prefix,"
                f" not in {unit!r}; give --scale {name}=FACTOR to multiply them: 1e-3 from mm to m, "
                f"0.017453292519943295 from degrees to rad, or 1 if the system has {name} in {unit!r}"
            )
        return self.cells.numbers(heading, self.scales.get(name, 1.0))

    def times(self, sampling_time: float) -> Array:
        """Return the times of the rows [s].

        ValueError: there is no column of steps or times, or its unit is unknown.
        """
        names = [name for name, (heading, _) in self.headings.items() if self.time in (name, heading)]
        for name in names if self.time else filter(self.headings.__contains__, (*_TIMES, *_STEPS)):
            heading, unit = self.headings[name]
            if name in _STEPS:
                return self.cells.numbers(heading) * sampling_time
            if unit not in _LENGTHS:
                known = ", ".join(filter(None, _LENGTHS))
                raise ValueError(f"{heading}: expected a unit of time, one of {known}, got {unit!r}")
            return self.cells.numbers(heading, _LENGTHS[unit])
        wanted = f"{self.time} (--time)" if self.time else "k or step, or t or time (or --time NAME)"
        raise ValueError(f"expected a column named {wanted}; the columns are {', '.join(self.headings)}")

    def table(self, plant: ConstrainedSystem) -> Table:
        """Return states and inputs at the steps. ValueError: a column is missing, or a time is no step."""
        system, steps = plant.system, self.times(plant.sampling_time) / plant.sampling_time
        if missing := [name for name in (*system.states, *system.inputs) if name not in self.headings]:
            raise ValueError(
                f"there is no column {missing[0]}: a table at the steps has a column for each state and input; for "
                "curves of some states only, give an --interpolation"
            )
        whole = np.round(steps)
        follows = np.append(True, np.diff(whole) == 1)
        if wrong := np.flatnonzero(~((np.abs(steps - whole) <= _OFF) & follows)).tolist():
            i = wrong[0]
            before = f" after {steps[i - 1]:.9g}" if i else ""
            raise ValueError(
                f"{self.cells.places[i]}: rows must be successive steps, k or t = k T with "
                f"T = {plant.sampling_time:g} s, got the step {steps[i]:.9g}{before}"
            )
        states, inputs = (np.stack([self[name] for name in names], axis=1) for names in (system.states, system.inputs))
        if len(inputs) > 1 and np.all(np.isnan(inputs[-1])):
            inputs = inputs[:-1]
        return Table(states, inputs, int(whole[0]))

    def samples(self, plant: ConstrainedSystem) -> dict[str, Samples]:
        """Return samples for each flat output that a column shows, by that column's name: a state, or z1, z2, ….

        Of several such columns, the one that `sampled_names` lists first is taken.

        ValueError: no column has values of a flat output.
        """
        times = self.times(plant.sampling_time)
        shown = [sampled_names(plant, signal) for signal in range(plant.signal_count)]
        found = [name for names in shown if (name := next((name for name in names if name in self.headings), None))]
        if not found:
            wanted = " or ".join(name for names in shown for name in names)
            raise ValueError(
                f"no column has values of a flat output; expected {wanted}, got {', '.join(self.headings)}"
            )
        return {name: Samples(times, self[name]) for name in found}


def read_columns(path: Path, decimal: str = ".", names: Collection[str] = ()) -> Columns:
    """Read a CSV file with a header, separated as `CsvLayout` detects; `decimal` is the mark in numbers.

    Headings that are one of `names`, such as "x(1)", have no unit.

    InputError: it cannot be read, or has no such form.
    """
    table = csv_table(path, CsvLayout(missing=("",), decimal=decimal))
    filled = [i for i, row in enumerate(zip(*table.columns.values(), strict=True)) if any(row)]
    if len(filled) < 2:
        raise InputError(f"{path}: expected a header and two rows at least, got {len(filled)} rows that are not empty")
    headings = dict[str, tuple[str, str]]()
    for heading in table.columns:
        match = None if heading in names else _HEADING.fullmatch(heading)
        name, unit = match.groups("s") if match else (heading, "s")
        if name in headings:
            raise InputError(f"{path}: expected a header of different names, but {name!r} is there twice")
        headings[name] = heading, unit.strip()
    return Columns(replace(table.part(filled), advice=""), headings)  # it advises changes of a `CsvLayout`
