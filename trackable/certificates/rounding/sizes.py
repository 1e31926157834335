"""Sizes of stored numbers for which the analysis of rounding holds: nothing overflows, and no factor is lost."""

from fractions import Fraction
from functools import lru_cache

import numpy as np

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.kernels.table import balls_of
from trackable.certificates.rounding.rows import rows
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.flat.trajectory import Trajectory
from trackable.systems.formulas.expression import Constant, Power, all_nodes
from trackable.systems.reference import Reference
from trackable.systems.signals.pieces import PolynomialPieces
from trackable.systems.signals.signal import Signal

_LARGEST, _SMALLEST, _LARGEST_KERNEL = 1e30, 1e-30, 1e100
_LARGEST_POWER, _HIGHEST_DEGREE = 1e100, 50


def has_sane_numbers(reference: Reference) -> bool:
    """Whether all stored numbers have sizes for which roundings can be bounded."""
    return _has_sane_weights(reference.plant) and all(_is_sane(signal) for signal in reference.signals)


@lru_cache
def _has_sane_weights(plant: ConstrainedSystem) -> bool:
    every = rows(plant)
    gross = [row.gross for row in every if not row.formulas]
    weights = [w for of_signals, offset in gross for w in (*of_signals, offset) if w]
    weights += [abs(w) for row in every if row.formulas for w, _ in row.used]
    weights += [abs(Fraction(c)) for row in every for part in row.formulas for c in _constants(part) if c]
    return plant.sampling_time >= _SMALLEST and all(_SMALLEST <= w <= _LARGEST for w in weights)


def _constants(trajectory: Trajectory) -> list[float]:
    nodes = list(all_nodes(trajectory.formula))
    powers = [node.exponent for node in nodes if isinstance(node, Power)]
    return [node.value for node in nodes if isinstance(node, Constant)] + powers


def _is_sane(signal: Signal) -> bool:
    if isinstance(signal, PolynomialPieces):
        return _are_sane_pieces(signal)
    hyperparameters = list(signal.kernel.hyperparameters.values())
    numbers = np.concatenate([[signal.mean], hyperparameters, signal.weights, signal.centres])
    with ball_arithmetic(2):
        size = balls_of(signal.kernel).largest.size
        return bool(
            np.all(np.abs(numbers) <= _LARGEST) and min(hyperparameters) >= _SMALLEST and size <= _LARGEST_KERNEL
        )


def _are_sane_pieces(signal: PolynomialPieces) -> bool:
    numbers, lengths = np.abs([*signal.breakpoints, *signal.coefficients.ravel()]), np.diff(signal.breakpoints)
    return bool(
        np.all(numbers <= _LARGEST)
        and np.min(lengths) >= _SMALLEST
        and signal.degree <= _HIGHEST_DEGREE
        and max(float(np.max(lengths)), 1.0) ** signal.degree <= _LARGEST_POWER
    )
