"""Tables, a theorem of its own: states and inputs at steps, without a formula between them.

Theorem. If `check` answers Proved of a table, then at each step the rows of X and U are kept, and |x(k + 1) − f(x(k),
u(k))| is at most the tolerance for each state. Nothing is said about times between the steps, nor about a flat form.
If it answers Refuted of a refuted table, then at the step that it names, one of these is broken by at least what it
names. Both are verified number by number, in rational arithmetic for linear systems.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from trackably.checker.formulas import Intervals, evaluate
from trackably.checker.intervals import Real, UndefinedError, at_most, exact_sum, exactly, ratio
from trackably.checker.subject import LinearSystem, Polytope, Row, System
from trackably.checker.trajectories import why_no_plant
from trackably.checker.watch import progress, tick

FORMAT, REFUTED, VERSION = "trackably table", "trackably refuted table", 1

Part = Literal["states", "inputs", "dynamics"]


@dataclass(frozen=True)
class Table:
    """States and inputs at the steps from `first_step` on; the last state may have no input."""

    first_step: int
    states: tuple[tuple[float, ...], ...]
    inputs: tuple[tuple[float, ...], ...]
    system: System
    state_set: Polytope
    input_set: Polytope
    tolerance: float


@dataclass(frozen=True)
class RefutedTable:
    """At a `step`, a table violates a row of its state or input set, or the dynamics of a state,
    by at least `violation`.

    `index` counts the rows of the set, or the states, from 0.
    """

    table: Table
    step: int
    part: Part
    index: int
    violation: float


def check_table(table: Table) -> str | None:
    """Return the first step at which a bound or the dynamics are not shown to hold; None if there is none."""
    if reason := _misfit(table):
        return reason
    for k, (side, values, rows) in enumerate(
        (("states", table.states, table.state_set.rows), ("inputs", table.inputs, table.input_set.rows))
    ):
        progress(k, 3)
        for step, row in enumerate(values):
            for i, bound in enumerate(rows):
                tick()
                if not _keeps(bound, row):
                    return f"table: bound {i} of the {side} is broken at step {table.first_step + step}"
    for step in range(len(table.states) - 1):
        tick()
        if reason := _why_not_obeyed(table, step):
            return reason
    return None


def _misfit(table: Table) -> str | None:
    """Return which parts do not fit together; None if all do."""
    sides = ((table.system.states, table.states), (table.system.inputs, table.inputs))
    if len(table.inputs) not in (len(table.states), len(table.states) - 1) or len(table.states) < 2:
        return "shapes: there must be two states at least, and an input for each but the last, which may have one"
    if any(len(row) != len(names) for names, values in sides for row in values):
        return "shapes: every step needs a number for each state, or for each input"
    return why_no_plant(table.system, table.state_set, table.input_set)


def check_refuted_table(refuted: RefutedTable) -> str | None:
    """Return why no violation is shown at the named step; None if it is."""
    table, row = refuted.table, refuted.step - refuted.table.first_step
    if reason := _misfit(table):
        return reason
    values, rows = table.states, table.state_set.rows
    if refuted.part == "inputs":
        values, rows = table.inputs, table.input_set.rows
    last, count = len(values), len(rows)
    if refuted.part == "dynamics":
        last, count = len(table.states) - 1, len(table.system.states)
    if not (0 <= row < last and 0 <= refuted.index < count):
        return f"at: the table has no step {refuted.step}, or no index {refuted.index} of the {refuted.part}"
    by, index = Fraction(refuted.violation), refuted.index
    if refuted.part != "dynamics":
        value, bound = value_of_row(rows[index], values[row]), rows[index]
        broken = value + by <= Fraction(bound.lower) or Fraction(bound.upper) + by <= value
    else:
        found = differences(table, row)
        if isinstance(found, str):
            return found
        broken = _is_at_least(found[index], Fraction(table.tolerance) + by)
    return None if broken else f"value: nothing is shown to be broken by {refuted.violation!r} there"


def _keeps(bound: Row, values: tuple[float, ...]) -> bool:
    return Fraction(bound.lower) <= value_of_row(bound, values) <= Fraction(bound.upper)


def value_of_row(bound: Row, values: tuple[float, ...]) -> Fraction:
    """Return the sum that a row bounds, exactly."""
    return exact_sum(r * Fraction(v) for r, v in zip(bound.row, values, strict=True))


def _why_not_obeyed(table: Table, row: int) -> str | None:
    found = differences(table, row)
    if isinstance(found, str):
        return found
    if all(_is_at_most(difference, table.tolerance) for difference in found):
        return None
    where = f"step {table.first_step + row}"
    return f"table: the system does not lead to within the tolerance of the state after {where}"


def _is_at_most(difference: Fraction | Real, by: float) -> bool:
    return difference <= by if isinstance(difference, Fraction) else at_most(difference, by)


def _is_at_least(difference: Fraction | Real, by: Fraction) -> bool:
    return difference >= by if isinstance(difference, Fraction) else bool(difference.a >= ratio(by).b)


def differences(table: Table, row: int) -> Sequence[Fraction | Real] | str:
    """Return |x(k + 1) − f(x(k), u(k))| for each state: exactly for a linear system, otherwise as intervals.

    If f may be undefined, return a sentence.
    """
    system, x, u, successor = table.system, table.states[row], table.inputs[row], table.states[row + 1]
    if isinstance(system, LinearSystem):
        exact = [
            exact_sum(Fraction(a) * Fraction(v) for a, v in zip((*a_row, *b_row, c), (*x, *u, 1.0), strict=True))
            for a_row, b_row, c in zip(system.A, system.B, system.c, strict=True)
        ]
        return [abs(m - Fraction(s)) for m, s in zip(exact, successor, strict=True)]
    values = dict(zip((*system.states, *system.inputs), map(exactly, (*x, *u)), strict=True))
    try:
        made = [evaluate(formula, values, Intervals()) for formula in system.f]
    except UndefinedError as undefined:
        return f"table: f is not shown to be defined at step {table.first_step + row}: {undefined}"
    return [abs(value - exactly(s)) for value, s in zip(made, successor, strict=True)]
