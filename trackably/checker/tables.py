"""Tables of states x(k) and inputs u(k) at steps k, without formulas for times in between. A theorem of its own.

Theorem. If `check` answers Proved of a table, then at each step the rows of X and U are kept, and |x(k + 1) − f(x(k),
u(k))| is at most the tolerance for each state. Nothing is said about times between the steps, nor about a flat form.
If `check` answers Refuted of a refuted table, then at the step that the file names, a row of X or U is broken by at
least the stated violation, or |x(k + 1) − f(x(k), u(k))| exceeds the tolerance by at least this number for a state.
Both are verified number by number, in rational arithmetic for linear systems, otherwise in interval arithmetic.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Literal

from trackably.checker.answers import FailedStepError
from trackably.checker.form import file_of, reader_of
from trackably.checker.intervals import Real, UndefinedError, at_most, exact_dot, exactly
from trackably.checker.limits import INSTANTS, LATEST_STEP
from trackably.checker.models import enclose
from trackably.checker.subject import FloatVector, LinearSystem, Plant, Positive
from trackably.checker.trajectories import check_plant
from trackably.checker.watch import progress, tick

FORMAT, REFUTED, VERSION = "trackably table", "trackably refuted table", 1

Part = Literal["states", "inputs", "dynamics"]
Step = Annotated[int, LATEST_STEP, -LATEST_STEP]
Rows = Annotated[tuple[FloatVector, ...], INSTANTS]


@dataclass(frozen=True)
class TableSteps:
    """States and inputs at the steps from `first_step` on, row by row; the last state may have no input."""

    first_step: Step
    states: Rows
    inputs: Rows


@dataclass(frozen=True)
class Table:
    """A table of the states and inputs of a plant.

    `tolerance` is the largest allowed difference between a state and f of the state and the input before it.
    """

    table: TableSteps
    plant: Plant
    tolerance: Positive


@dataclass(frozen=True)
class BrokenPart:
    """A row of the state or input set, or the dynamics of a state, that a table breaks at a `step`.

    `part` says which of these is broken, and `violation` by how much at least. `index` is that of the row, or of the
    state, from 0 on.
    """

    step: Step
    part: Part
    index: Step
    violation: Positive


@dataclass(frozen=True)
class RefutedTable(Table):
    """A table, with the bound or the dynamics that it breaks: `at` says which, at which step, and by how much."""

    at: BrokenPart


read_table = file_of("table", VERSION, reader_of(Table))
read_refuted_table = file_of("refuted table", VERSION, reader_of(RefutedTable))


def check_table(table: Table) -> None:
    """Raise FailedStepError at the first step at which a bound or the dynamics are not shown to hold."""
    _check_lengths(table)
    for k, (part, rows) in enumerate(_rows(table).items()):
        progress(k, 3)
        for row in range(rows):
            step = table.table.first_step + row
            for i, excess in enumerate(excesses(table, part, row)):
                tick()
                if at_most(excess, Fraction(0)):
                    continue
                if part == "dynamics":
                    raise FailedStepError(
                        f"table: f(x, u) is not shown to be within the tolerance of the state after step {step}"
                    )
                raise FailedStepError(f"table: bound {i} of the {part} is broken at step {step}")


def _check_lengths(table: Table) -> None:
    """Raise FailedStepError unless all parts of a table fit together."""
    states, inputs, system = table.table.states, table.table.inputs, table.plant.system
    sides = ((system.states, states), (system.inputs, inputs))
    if len(inputs) not in (len(states), len(states) - 1) or len(states) < 2:
        raise FailedStepError(
            "shapes: a table needs two states at least, and an input for each state (but perhaps not for the last)"
        )
    if any(len(row) != len(names) for names, values in sides for row in values):
        raise FailedStepError(
            "shapes: rows of `states` need a number for each state, and rows of `inputs` one for each input"
        )
    check_plant(table.plant)


def _rows(table: Table) -> dict[Part, int]:
    """Return how many states, inputs, and pairs of a state and its successor the table has."""
    states, inputs = len(table.table.states), len(table.table.inputs)
    return {"states": states, "inputs": inputs, "dynamics": states - 1}


def check_refuted_table(refuted: RefutedTable) -> None:
    """Raise FailedStepError unless the named violation is shown."""
    at, row = refuted.at, refuted.at.step - refuted.table.first_step
    _check_lengths(refuted)
    found = excesses(refuted, at.part, row) if 0 <= row < _rows(refuted)[at.part] else []
    if not 0 <= at.index < len(found):
        raise FailedStepError(f"at: the table has no step {at.step}, or no index {at.index} of the {at.part}")
    if not at_most(Fraction(at.violation), found[at.index]):
        where = f"step {at.step}: index {at.index} of the {at.part}"
        raise FailedStepError(f"value: {where} is not shown to be broken by {at.violation!r}")


def excesses(table: Table, part: Part, row: int) -> Sequence[Fraction | Real]:
    """Return by how much each bound of a part, or each state's tolerance, is exceeded in a row; ≤ 0 where it is kept.

    The numbers are exact, except for the dynamics of nonlinear systems, for which they are intervals. Raise
    FailedStepError if f may be undefined.
    """
    of, plant = table.table, table.plant
    if part != "dynamics":
        values, bounded = (of.states, plant.state_set) if part == "states" else (of.inputs, plant.input_set)
        pairs = [(exact_dot(bound.row, map(Fraction, values[row])), bound.ends) for bound in bounded.rows]
        return [max(low - value, value - high) for value, (low, high) in pairs]
    system, both, successor = plant.system, (*of.states[row], *of.inputs[row]), of.states[row + 1]
    if isinstance(system, LinearSystem):
        exact, tolerance = [*map(Fraction, both)], Fraction(table.tolerance)
        rows = zip(*system.exact, map(Fraction, successor), strict=True)
        return [abs(exact_dot((*A, *B), exact) + c - s) - tolerance for A, B, c, s in rows]
    known = dict(zip((*system.states, *system.inputs), map(exactly, both), strict=True))
    try:
        made = [enclose(formula, known) for formula in system.f]
    except UndefinedError as undefined:
        where = f"step {of.first_step + row}"
        raise FailedStepError(f"table: f is not shown to be defined at {where}: {undefined}") from None
    return [abs(value - exactly(s)) - table.tolerance for value, s in zip(made, successor, strict=True)]
