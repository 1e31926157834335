"""The steps for a table: at each instant bounds are kept, and the dynamics within the tolerance."""

from fractions import Fraction

from trackable.checker.arithmetic.domains import UndefinedError
from trackable.checker.arithmetic.intervals import at_most, exactly
from trackable.checker.formulas.formula import evaluate, names
from trackable.checker.formulas.values import Intervals
from trackable.checker.subject import LinearSystem, Row, System
from trackable.checker.table import Table
from trackable.checker.watch import progress, tick


def check_table(table: Table) -> str | None:
    """Return the first step at which a bound or the dynamics are not shown to be kept; None where all are."""
    if reason := _misfit(table):
        return reason
    for k, (side, values, rows) in enumerate(
        (("states", table.states, table.state_set.rows), ("inputs", table.inputs, table.input_set.rows))
    ):
        progress(k, 3)
        for step, row in enumerate(values):
            for i, bound in enumerate(rows):
                if not _kept(bound, row):
                    return f"table: bound {i} of the {side} is broken at step {table.first_step + step}"
    for step in range(len(table.states) - 1):
        tick()
        if reason := _why_not_obeyed(table, step):
            return reason
    return None


def _misfit(table: Table) -> str | None:
    """Return what does not fit together; None where everything does."""
    system = table.system
    n, m = len(system.states), len(system.inputs)
    sides = ((n, table.states, table.state_set), (m, table.inputs, table.input_set))
    if len(table.inputs) not in (len(table.states), len(table.states) - 1) or len(table.states) < 2:
        return "shapes: there must be two states at least, and an input for each but the last, which may have one"
    for count, values, bounded in sides:
        rows = [*values, *(bound.row for bound in bounded.rows)]
        if bounded.dimension != count or any(len(row) != count for row in rows):
            return "shapes: every step and every bound needs a number for each state, or for each input"
    if len({*system.states, *system.inputs}) != n + m:
        return "names: states and inputs must all be called differently"
    return None if _fits(system, n, m) else "shapes: the system has other states and inputs than the table"


def _fits(system: System, n: int, m: int) -> bool:
    if isinstance(system, LinearSystem):
        rows = [len(row) for row in system.A] == [n] * n and [len(row) for row in system.B] == [m] * n
        return rows and len(system.c) == n
    known = {*system.states, *system.inputs}
    return len(system.f) == n and all(names(formula) <= known for formula in system.f)


def _kept(bound: Row, values: tuple[float, ...]) -> bool:
    value = sum((r * Fraction(v) for r, v in zip(bound.row, values, strict=True)), Fraction(0))
    return Fraction(bound.lower) <= value <= Fraction(bound.upper)


def _why_not_obeyed(table: Table, step: int) -> str | None:
    system, x, u, successor = table.system, table.states[step], table.inputs[step], table.states[step + 1]
    where = f"step {table.first_step + step}"
    if isinstance(system, LinearSystem):
        made = [
            sum((Fraction(a) * Fraction(v) for a, v in zip((*a_row, *b_row), (*x, *u), strict=True)), Fraction(c))
            for a_row, b_row, c in zip(system.A, system.B, system.c, strict=True)
        ]
        apart = [abs(m - Fraction(s)) for m, s in zip(made, successor, strict=True)]
        obeyed = all(d <= Fraction(table.tolerance) for d in apart)
    else:
        values = dict(zip((*system.states, *system.inputs), map(exactly, (*x, *u)), strict=True))
        try:
            found = [evaluate(formula, values, Intervals()) for formula in system.f]
        except UndefinedError as undefined:
            return f"table: f is not shown to be defined at {where}: {undefined}"
        obeyed = all(
            at_most(abs(value - exactly(s)), table.tolerance) for value, s in zip(found, successor, strict=True)
        )
    return None if obeyed else f"table: the system does not lead to within the tolerance of the state after {where}"
