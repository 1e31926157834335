"""Bound the error of evaluating a reference in float64, without evaluating it.

Assumed: IEEE arithmetic rounding to nearest (u = 2⁻⁵³), sums of products in any order (`KernelSum.summed`, no
transforms), and NumPy's functions and powers within 4 units in the last place. Everything else follows from the
formulas in trackable.gp. All bounds over-estimate; enlarging them by 2 % (`_SLACK`) covers terms of second order in u.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import arb

from trackable.certificates.balls.arithmetic import ball_arithmetic, float_above
from trackable.certificates.balls.formulas import UndefinedError
from trackable.certificates.exact import rational
from trackable.certificates.kernels.table import balls_of
from trackable.certificates.rounding.formulas import Rounded, RoundedArithmetic
from trackable.certificates.rounding.pieces import are_sane, pieces_error
from trackable.certificates.rounding.signals import signal_error
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.flat.functional import Functional
from trackable.systems.flat.trajectory import Coordinate, Trajectory
from trackable.systems.formulas.evaluation import evaluate
from trackable.systems.formulas.expression import Constant, Power, all_nodes
from trackable.systems.reference import Reference
from trackable.systems.signals.pieces import PolynomialPieces
from trackable.systems.signals.signal import Signal

_SLACK = 1.02
LATEST = 1e60
"""Times up to which decaying kernels can be evaluated without overflow [s]."""

_LARGEST, _SMALLEST, _LARGEST_KERNEL = 1e30, 1e-30, 1e100


def evaluation_errors(reference: Reference, until: float) -> dict[str, float]:
    """Bound |float64 − exact| of each bounded quantity of a reference at all times |t| ≤ `until` [s].

    "exact" means the value at the float64 t itself, or at the exact k T_s if t is the rounded product. Bounds of
    formulas hold while the states lie in their set; they are infinite where a formula may not be defined even then.
    """
    errors = {}
    for row in _rows(reference.plant):
        try:
            errors[row.name] = _row_error(reference, row, until)
        except UndefinedError:
            errors[row.name] = math.inf
    return errors


def why_unbounded(reference: Reference, until: float) -> str:
    """Return why an error is infinite; an empty string where all are finite."""
    try:
        for row in _rows(reference.plant):
            _row_error(reference, row, until)
    except UndefinedError as undefined:
        return str(undefined)
    return ""


@dataclass(frozen=True)
class _Row:
    """Σ_i `weights`[i] `parts`[i] of the states or the inputs: a bounded quantity."""

    name: str
    weights: tuple[Fraction, ...]
    parts: tuple[Coordinate, ...]

    @property
    def functionals(self) -> list[Functional]:
        return [part for part in self.parts if isinstance(part, Functional)]

    @property
    def formulas(self) -> list[Trajectory]:
        return [part for part in self.parts if isinstance(part, Trajectory)]


def _rows(plant: ConstrainedSystem) -> list[_Row]:
    parts = {"state": plant.flatness.states, "input": plant.flatness.inputs}
    return [_Row(limit.name, limit.row, parts[limit.side]) for limit in plant.constraints]


def _row_error(reference: Reference, row: _Row, until: float) -> float:
    """Bound the error of a row. UndefinedError where there is no bound."""
    plant = reference.plant
    with ball_arithmetic(2):
        ahead = max(plant.flatness.orders) * arb(plant.sampling_time)
        of_signals = [_signal_error(signal, arb(until) + ahead, ahead) for signal in reference.signals]
        roundings = 8 + sum(plant.flatness.orders) + len(plant.system.states) + len(plant.system.inputs)
        if not row.formulas:
            weights, offset = _absolute_weights(row.weights, row.functionals)
            return float_above(_SLACK * _functional_error(weights, offset, of_signals, roundings).error)
        total, size = arb(0), arb(0)
        for weight, part in zip(row.weights, row.formulas, strict=True):
            if weight:
                found = _formula_error(plant, part, of_signals, roundings)
                total += rational(abs(weight)) * found.error
                size += rational(abs(weight)) * abs(found.computed)
        return float_above(_SLACK * (total + roundings * arb(2) ** -53 * size) + arb(2) ** -300)


def _functional_error(
    weights: list[Fraction], offset: Fraction, of_signals: list[tuple[arb, arb]], roundings: int
) -> Rounded:
    """Bound the error of Σ_c w_c z_c + offset, and its size, as if no terms cancelled."""
    total = sum((rational(w) * error for w, (error, _) in zip(weights, of_signals, strict=True)), arb(0))
    size = sum((rational(w) * size for w, (_, size) in zip(weights, of_signals, strict=True)), rational(offset))
    tiny = arb(2) ** -300 * (1 + rational(sum(weights, Fraction(0))))  # underflows
    return Rounded(arb(0, 1) * size, total + roundings * arb(2) ** -53 * size + tiny)


def _formula_error(
    plant: ConstrainedSystem, trajectory: Trajectory, of_signals: list[tuple[arb, arb]], roundings: int
) -> Rounded:
    """Bound the error of a formula whose arguments take all values that signals can have, and states those of X."""
    values = {}
    for name, functional in trajectory.arguments:
        found = _functional_error(*_absolute_weights([Fraction(1)], [functional]), of_signals, roundings)
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


def _absolute_weights(row: Sequence[Fraction], functionals: list[Functional]) -> tuple[list[Fraction], Fraction]:
    """Return Σ_i |row_i| Σ_j |w_ij| of every signal, and Σ_i |row_i offset_i|.

    Terms that cancel in exact arithmetic may not cancel if states are evaluated one by one and then combined.
    """
    sizes = [abs(v) for v in row]
    weights = [
        sum((size * abs(w) for size, q in zip(sizes, functionals, strict=True) for w in q.weights[c]), Fraction(0))
        for c in range(len(functionals[0].weights))
    ]
    return weights, sum((s * abs(q.offset) for s, q in zip(sizes, functionals, strict=True)), Fraction(0))


def _signal_error(signal: Signal, latest: arb, ahead: arb) -> tuple[arb, arb]:
    if isinstance(signal, PolynomialPieces):
        return pieces_error(signal, latest, ahead)
    return signal_error(signal, latest, ahead)


def evaluated_until(signals: Iterable[Signal], window: float) -> float:
    """Return the time [s] up to which evaluation is claimed: a thousand windows if errors grow with time."""
    return 1e3 * window if any(map(_repeats, signals)) else LATEST


def _repeats(signal: Signal) -> bool:
    if isinstance(signal, PolynomialPieces):
        return signal.beyond == "period"
    return balls_of(signal.kernel).has_periodic_part


def has_sane_numbers(reference: Reference) -> bool:
    """Whether all stored numbers have sizes for which the analysis above holds (no overflow, no underflow)."""
    plant = reference.plant
    rows = _rows(plant)
    gross = [_absolute_weights(row.weights, row.functionals) for row in rows if not row.formulas]
    weights = [w for of_signals, offset in gross for w in (*of_signals, offset) if w]
    weights += [abs(w) for row in rows if row.formulas for w in row.weights if w]
    weights += [abs(Fraction(c)) for row in rows for part in row.formulas for c in _constants(part) if c]
    if not (plant.sampling_time >= _SMALLEST and all(_SMALLEST <= w <= _LARGEST for w in weights)):
        return False
    return all(_is_sane(signal) for signal in reference.signals)


def _constants(trajectory: Trajectory) -> list[float]:
    nodes = list(all_nodes(trajectory.formula))
    powers = [node.exponent for node in nodes if isinstance(node, Power)]
    return [node.value for node in nodes if isinstance(node, Constant)] + powers


def _is_sane(signal: Signal) -> bool:
    if isinstance(signal, PolynomialPieces):
        return are_sane(signal)
    hyperparameters = list(signal.kernel.hyperparameters.values())
    numbers = np.concatenate([[signal.mean], hyperparameters, signal.weights, signal.centres])
    with ball_arithmetic(2):
        size = balls_of(signal.kernel).beyond(arb(0)).size
        return bool(
            np.all(np.abs(numbers) <= _LARGEST) and min(hyperparameters) >= _SMALLEST and size <= _LARGEST_KERNEL
        )
