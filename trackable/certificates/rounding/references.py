"""Bound the error of evaluating a reference in float64, without evaluating it.

Assumed: IEEE arithmetic rounding to nearest (u = 2⁻⁵³), sums of products in any order (`KernelSum.summed`, no
transforms), and NumPy's functions and powers within 4 units in the last place. Everything else follows from the
formulas in trackable.gp. All bounds over-estimate; enlarging them by 2 % (`rows.SLACK`) covers terms of second
order in u.
"""

import math
from collections.abc import Iterable
from fractions import Fraction

import numpy as np
from flint import arb

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic, float_above
from trackable.certificates.balls.formulas import UndefinedError
from trackable.certificates.exact import rational
from trackable.certificates.kernels.base import KernelBalls
from trackable.certificates.kernels.table import balls_of
from trackable.certificates.rounding.flat import has_flat_form, nearby_error
from trackable.certificates.rounding.formulas import Rounded, RoundedArithmetic
from trackable.certificates.rounding.rows import SLACK, Row, SignalErrors, absolute_weights, rows
from trackable.gp.signal import KernelSum
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.flat.trajectory import Trajectory
from trackable.systems.formulas.evaluation import evaluate
from trackable.systems.reference import Reference

LATEST = 1e60
"""Times up to which decaying kernels can be evaluated without overflow [s]."""


def evaluation_errors(reference: Reference, until: float, times: Array | None = None) -> dict[str, float]:
    """Bound |float64 − exact| of each bounded quantity of a reference at all times |t| ≤ `until` [s].

    "exact" means the value at the float64 t itself, or at the exact k T_s if t is the rounded product. Bounds of
    formulas hold while the states lie in their set; they are infinite where a formula may not be defined even then.
    Those of a flat form hold at all `times` [s], or at some times among the centres, and nearly so between these: the
    proof shows in each box that they do (`rounding.flat`).
    """
    errors, plant = {}, reference.plant
    with ball_arithmetic(2):
        of_signals = SignalErrors.of(reference, until)
        for row in rows(plant):
            try:
                if row.formulas and has_flat_form(plant):
                    errors[row.name] = nearby_error(reference, row, of_signals, times)
                else:
                    errors[row.name] = _row_error(plant, row, of_signals)
            except UndefinedError:
                errors[row.name] = math.inf
    return errors


def why_unbounded(reference: Reference, until: float) -> str:
    """Return why an error is infinite; an empty string where all are finite."""
    try:
        with ball_arithmetic(2):
            of_signals = SignalErrors.of(reference, until)
            for row in rows(reference.plant):
                _row_error(reference.plant, row, of_signals)
    except UndefinedError as undefined:
        return str(undefined)
    return ""


def _row_error(plant: ConstrainedSystem, row: Row, of_signals: SignalErrors) -> float:
    """Bound the error of a row. UndefinedError where there is no bound."""
    if not row.formulas:
        return float_above(SLACK * of_signals.of_sum(*row.gross).error)
    total, size = arb(0), arb(0)
    for weight, part in row.used:
        if isinstance(part, Trajectory):
            found = _formula_error(plant, part, of_signals)
            total += rational(abs(weight)) * found.error
            size += rational(abs(weight)) * abs(found.computed)
    return float_above(SLACK * (total + of_signals.roundings * arb(2) ** -53 * size) + arb(2) ** -300)


def _formula_error(plant: ConstrainedSystem, trajectory: Trajectory, of_signals: SignalErrors) -> Rounded:
    """Bound the error of a formula whose arguments take all values that signals can have, and states those of X."""
    values = {}
    for name, functional in trajectory.arguments:
        found = of_signals.of_sum(*absolute_weights([Fraction(1)], [functional]))
        exact = (
            _within(plant, plant.system.states.index(name), found.exact) if name in plant.system.states else found.exact
        )
        values[name] = Rounded(exact, found.error)
    return evaluate(trajectory.formula, values, RoundedArithmetic())


def _within(plant: ConstrainedSystem, i: int, exact: arb) -> arb:
    """Return the part of a ball that rows of the state set allow, from rows that bound the i-th state alone."""
    low, high = exact.lower(), exact.upper()
    for row, bounds in plant.state_set.intervals:
        if row[i] and not any(np.delete(row, i)):
            ends = [arb(bounds.lower) / arb(row[i]), arb(bounds.upper) / arb(row[i])]
            low, high = low.max(ends[0].min(ends[1])), high.min(ends[0].max(ends[1]))
    return low.union(high)


def evaluated_until(signals: Iterable[KernelSum], window: float, windows: float = 1e3) -> float:
    """Return the time [s] up to which evaluation is claimed: so many windows if errors grow with time.

    Where every periodic part has a factor that decays fast enough, they do not.
    """
    far = windows * window
    return far if any(_errors_grow(balls_of(signal.kernel), far) for signal in signals) else LATEST


def claimed_windows(plant: ConstrainedSystem) -> float:
    """Return for how many windows, or periods, evaluation is claimed if errors grow with time.

    Flat forms take differences of signals in short steps, which enlarges errors: over fewer periods they are smaller.
    """
    return 1e2 if has_flat_form(plant) else 1e3


def _errors_grow(kernel: KernelBalls, far: float) -> bool:
    with ball_arithmetic(2):
        late, later = (kernel.sensitivity(arb(t)).stretch for t in (far, LATEST))
    return kernel.has_periodic_part and not later <= 2 * late
