"""The command `python -m trackably certify TABLE --system FILE`: what it reads, what it prints, and its exit code.

FILE has a system and its sets as `system`, `state_set` and `input_set`; TABLE has a row for each step or time, and
columns that are named as states and inputs, in their units.
"""

import re
from argparse import Namespace
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from trackably.arrays import Array
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.errors import InputError
from trackably.files import errors_of, from_json, read_bytes, read_yaml, unwritable
from trackably.given.table import CertifiedTable, RefutedTable, Table, certify_table
from trackably.gp.samples import Samples
from trackably.progress import progress_bar
from trackably.recordings import tables
from trackably.recordings.csv_file import CsvLayout, csv_table
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.sampling import sampled_names
from trackably.systems.written import fields_of, read_part, set_of, system_of

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

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
    cells = csv_table(given.table, CsvLayout(missing=("",), decimal=given.decimal))
    cells = replace(cells, advice="")  # it advises changes of a `CsvLayout`
    with errors_of(given.table):
        times = times_of_rows(cells, plant.sampling_time, given.time)
        if not given.interpolation:
            return certify_table(table_of(cells, times, plant), plant, given.tolerance)
        samples = samples_of(cells, times, plant)
    from trackably.given.certify import certify  # noqa: PLC0415  takes longer to load than all that was read so far

    with errors_of(given.table):
        curves = {name: spline_through(of, DEGREES[given.interpolation], given.claim) for name, of in samples.items()}
    return certify(curves, plant, given.claim)


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


DEGREES = {"linear": 1, "cubic": 3, "quintic": 5}
"""Degrees of the splines that join rows, by the names of interpolations."""

_TIMES, _STEPS = ("t", "time"), ("k", "step")
_SECONDS = "s", "sec", "second", "seconds"
_OFF = 1e-6  # in sampling times: a row may be this far from a whole step


def times_of_rows(cells: tables.Table, sampling_time: float, named: str | None) -> Array:
    """Return the times of the rows [s], from the column `named`, or by default from one of times or steps.

    ValueError: there is no such column, or its name has another unit behind it.
    """
    wanted = (named,) if named else (*_TIMES, *_STEPS)
    name = next((name for name in wanted if name in cells.columns), None)
    if name is None:
        raise ValueError(f"expected a column named {' or '.join(wanted)} (--time names another one){_columns(cells)}")
    if (unit := re.search(r"[(\[](.*)[)\]]$", name)) and unit[1].strip() not in _SECONDS:
        raise ValueError(f"--time: expected times in seconds, but {name} names another unit; read_csv converts it")
    return cells.numbers(name) * (sampling_time if name in _STEPS else 1.0)


def table_of(cells: tables.Table, times: Array, plant: ConstrainedSystem) -> Table:
    """Return states and inputs at the steps. ValueError: a column is missing, or a time is no step."""
    system, steps = plant.system, times / plant.sampling_time
    if missing := [name for name in (*system.states, *system.inputs) if name not in cells.columns]:
        raise ValueError(
            f"there is no column {missing[0]}: a table at the steps has a column for each state and input, named as in "
            f"the system and in its units; for curves of some states only, give an --interpolation{_columns(cells)}"
        )
    whole = np.round(steps)
    follows = np.append(True, np.diff(whole) == 1)
    if wrong := np.flatnonzero(~((np.abs(steps - whole) <= _OFF) & follows)).tolist():
        i = wrong[0]
        before = f" after {steps[i - 1]:.9g}" if i else ""
        raise ValueError(
            f"{cells.places[i]}: rows must be successive steps, k or t = k T with T = {plant.sampling_time:g} s, got "
            f"the step {steps[i]:.9g}{before}"
        )
    states, inputs = (np.stack([cells.numbers(name) for name in of], axis=1) for of in (system.states, system.inputs))
    if len(inputs) > 1 and np.all(np.isnan(inputs[-1])):
        inputs = inputs[:-1]
    return Table(states, inputs, int(whole[0]))


def samples_of(cells: tables.Table, times: Array, plant: ConstrainedSystem) -> dict[str, Samples]:
    """Return samples for each flat output that a column shows, by that column's name: a state, or z1, z2, ….

    Of several such columns, the one that `sampled_names` lists first is taken.

    ValueError: no column has values of a flat output.
    """
    shown = [sampled_names(plant, signal) for signal in range(plant.signal_count)]
    found = [name for names in shown if (name := next((name for name in names if name in cells.columns), None))]
    if not found:
        wanted = " or ".join(name for names in shown for name in names)
        raise ValueError(f"no column has values of a flat output; expected {wanted}{_columns(cells)}")
    return {name: Samples(times, cells.numbers(name)) for name in found}


def spline_through(samples: Samples, degree: int, claim: str | None) -> "BSpline":
    """Return a spline through samples: at rest at both ends or periodic, as the claim needs it, or not-a-knot.

    Through fewer than `degree` + 1 samples, a not-a-knot spline is the polynomial through all of them.

    ValueError: there is one sample only, or those of a periodic curve begin and end at different values.
    """
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415  loaded for curves only

    if len(samples) < 2:
        raise ValueError("--interpolation: expected two rows at least, got one")
    degree = degree if claim else min(degree, len(samples) - 1)
    first, last = samples.values[[0, -1]].tolist()
    if claim == "all_phases" and not np.isclose(first, last, atol=1e-15):
        raise ValueError(
            f"--claim all_phases: expected the first value, {first:.10g}, again in the last row, got {last:.10g}"
        )
    still: Any = [(order, 0.0) for order in range(1, degree // 2 + 1)]
    ends: Any = {"all_times": (still, still), "all_phases": "periodic", None: None}[claim]
    return make_interp_spline(samples.times, samples.values, degree, bc_type=ends if degree > 1 else None)


def _columns(cells: tables.Table) -> str:
    return f"; the columns are {', '.join(cells.columns)}"
