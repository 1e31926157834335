"""Prove that a table keeps its bounds and its dynamics at the steps, or find where it breaks them most."""

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from functools import partial
from math import inf, nextafter
from typing import Any

import numpy as np
from flint import arb

from trackably.arguments import instance, real
from trackably.arrays import Array
from trackably.certificates.balls.arithmetic import ball_arithmetic, float_above
from trackably.certificates.balls.formulas import UndefinedError, at_balls
from trackably.certificates.judge import judged_file
from trackably.certificates.outcome import Unproved
from trackably.checker import Proved, Refuted
from trackably.given.table import CertifiedTable, Part, RefutedTable, Table
from trackably.systems.constrained import ConstrainedSystem, Side
from trackably.systems.linear import LinearSystem
from trackably.systems.sets.interval import Interval


def certify_table(table: Table, plant: ConstrainedSystem, tolerance: float) -> CertifiedTable | RefutedTable | Unproved:
    """Prove that a table keeps the plant's bounds at its steps, and its dynamics within a tolerance; or refute it.

    The tolerance is that of each state, in its unit. Of all violations the largest one is told, as a part of the width
    of its bound, or of the tolerance. Unproved are formulas that may not be defined at a step.

    ValueError: the table does not fit the plant, or the tolerance is not positive.
    """
    tolerance = _checked(table, plant, tolerance)
    refuted = partial(_refuted, table, plant, tolerance)
    broken, defect = list(_broken(table, plant, refuted)), Fraction(0)
    for k in range(len(table.states) - 1):
        try:
            apart = _defects(plant.system, table.states[k], table.inputs[k], table.states[k + 1])
        except UndefinedError as undefined:
            return _unproved(plant, table.first_step + k, tolerance, inf, str(undefined))
        for i, (name, (least, most)) in enumerate(zip(plant.system.states, apart, strict=True)):
            defect = max(defect, most)
            if (by := least - Fraction(tolerance)) > 0:
                what = (
                    f"the system leads to another {name} than that of the next step, beyond the tolerance {tolerance!r}"
                )
                broken.append((float(by) / tolerance, refuted(k, what, by, "dynamics", i)))
    if broken:
        return _judged(max(broken, key=lambda found: found[0])[1])
    if defect > Fraction(tolerance):
        short = float(defect - Fraction(tolerance))
        return _unproved(plant, table.first_step, tolerance, short, "the tolerance is next to what f leads to")
    return _judged(CertifiedTable(table, plant, tolerance, nextafter(float(defect), inf) if defect else 0.0))


def _judged(found: CertifiedTable | RefutedTable) -> CertifiedTable | RefutedTable | Unproved:
    """Return what the checker accepts, and Unproved where it refuses it."""
    _, verdict = judged_file(found.content)
    if isinstance(verdict, Proved if isinstance(found, CertifiedTable) else Refuted):
        return found
    why = f"the checker does not accept it ({verdict})"
    return _unproved(found.plant, found.table.first_step, found.tolerance, 0.0, why)


def _checked(table: Table, plant: ConstrainedSystem, tolerance: float) -> float:
    instance("certify_table: table", table, Table, "a Table")
    instance("certify_table: plant", plant, ConstrainedSystem, "a ConstrainedSystem")
    if not (tolerance := real("certify_table: tolerance", tolerance)) > 0:
        raise ValueError(f"certify_table: tolerance must be positive, got {tolerance}")
    wanted, given = (len(plant.system.states), len(plant.system.inputs)), (table.states.shape[1], table.inputs.shape[1])
    if wanted != given:
        raise ValueError(f"table: expected {wanted[0]} states and {wanted[1]} inputs, got {given[0]} and {given[1]}")
    return tolerance


def _unproved(plant: ConstrainedSystem, step: int, tolerance: float, short: float, reason: str) -> Unproved:
    t = step * plant.sampling_time
    return Unproved("difference to the next state", Interval(-tolerance, tolerance), (t, t), short, reason)


def _broken(
    table: Table, plant: ConstrainedSystem, refuted: Callable[..., RefutedTable]
) -> Iterator[tuple[float, RefutedTable]]:
    """Yield where bounds are broken, with the part of the width."""
    sides: tuple[tuple[Part, Side, Array], ...] = (
        ("states", "state", table.states),
        ("inputs", "input", table.inputs),
    )
    for part, side, values in sides:
        for i, limit in enumerate(limit for limit in plant.given_constraints if limit.side == side):
            low, high = Fraction(limit.bounds.lower), Fraction(limit.bounds.upper)
            for k, row in enumerate(values.tolist()):
                value = sum((r * Fraction(v) for r, v in zip(limit.row, row, strict=True)), Fraction(0))
                if (by := max(low - value, value - high)) > 0:
                    what = f"the {limit.name} breaks {limit.bounds.exactly}"
                    yield float(by) / limit.bounds.width, refuted(k, what, by, part, i)


def _defects(system: Any, x: Array, u: Array, successor: Array) -> list[tuple[Fraction, Fraction]]:
    """Return bounds of |x⁺ − f(x, u)| for each state; they are equal for linear systems."""
    if isinstance(system, LinearSystem):
        values = [Fraction(v) for v in (*x.tolist(), *u.tolist())]
        rows = np.hstack([system.A, system.B]).tolist()
        made = [
            sum((Fraction(a) * v for a, v in zip(row, values, strict=True) if a), Fraction(c))
            for row, c in zip(rows, system.c.tolist(), strict=True)
        ]
        return [(d, d) for d in (abs(m - Fraction(s)) for m, s in zip(made, successor.tolist(), strict=True))]
    named: Mapping[str, arb] = dict(
        zip((*system.states, *system.inputs), map(arb, (*x.tolist(), *u.tolist())), strict=True)
    )
    with ball_arithmetic():
        balls = [abs(at_balls(f, named) - arb(s)) for f, s in zip(system.f, successor.tolist(), strict=True)]
        return [(max(Fraction(-float_above(-ball)), Fraction(0)), Fraction(float_above(ball))) for ball in balls]


def _refuted(
    table: Table, plant: ConstrainedSystem, tolerance: float, row: int, what: str, by: Fraction, part: Part, index: int
) -> RefutedTable:
    step, below = table.first_step + row, max(nextafter(float(by), 0.0), 5e-324)
    return RefutedTable(step, step * plant.sampling_time, what, below, part, index, table, plant, tolerance)
