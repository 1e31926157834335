"""Feedback against disturbances: given, or the linear-quadratic regulator that leaves the most of the bounds."""

from itertools import product

import numpy as np
import scipy

from trackably.arguments import numbers
from trackably.arrays import Array, ArrayLike
from trackably.systems.disturbance.decay import NoInvariantSetError, closed_loop, errors_reach, spectral_radius
from trackably.systems.disturbance.sets import DisturbanceSet
from trackably.systems.linear import LinearSystem
from trackably.systems.sets.polytope import Polytope
from trackably.systems.sets.scales import squares_in_widths, unit_scales

INPUT_WEIGHTS = (1e-4, 1e-2, 1.0, 1e2)
RATES = (1.0, 0.95, 0.9, 0.8)
_SPARED = 0.05
_FREE = 1e-6
_BITS = 20
_NOTHING = 1e-10  # of the largest entry, in units of the sets


def given_feedback(feedback: ArrayLike, system: LinearSystem) -> Array:
    """Return a feedback K (m, n) that somebody chose. ValueError: its shape is another, or it is not finite."""
    K = numbers("feedback", feedback)
    n, m = system.B.shape
    if K.shape != (m, n) or not np.all(np.isfinite(K)):
        raise ValueError(f"feedback: K must be a finite matrix of shape ({m}, {n}), got {K.tolist()}")
    return K


def best_feedback(system: LinearSystem, state_set: Polytope, input_set: Polytope, disturbance: DisturbanceSet) -> Array:
    """Return the K (m, n) under which errors decay fastest, among the regulators that leave nearly the most room.

    Room is what Z leaves between two bounds, as a part of their distance, for the row where that is least. The
    regulators have some weights of the input and some rates of decay; errors are weighted in units of the sets. Nearly
    the most room is all but 0.05 of it: a little room buys an error that is forgotten in tens of steps instead of
    hundreds. Raises NoInvariantSetError where no regulator makes the error decay.
    """
    found: list[tuple[float, Array]] = []
    for weight, rate in product(INPUT_WEIGHTS, RATES):
        try:
            K = regulator(system, state_set, input_set, weight, rate)
            found.append((room(system, state_set, input_set, disturbance, K), K))
        except (np.linalg.LinAlgError, NoInvariantSetError):  # other weights may do
            continue
    if not found:
        raise NoInvariantSetError("feedback: no linear-quadratic regulator was found; give a feedback K of your own")
    most = max(left for left, _ in found)
    good = [K for left, K in found if left >= most - _SPARED]
    return min(good, key=lambda K: spectral_radius(closed_loop(system, K)))


def regulator(
    system: LinearSystem, state_set: Polytope, input_set: Polytope, input_weight: float, rate: float
) -> Array:
    """Return K of min Σ_k rate⁻²ᵏ (‖x(k)‖²_Q + `input_weight` ‖u(k)‖²_R), with Q and R in units of the sets.

    All eigenvalues of A + B K are smaller than `rate` ≤ 1. K has few binary digits, so that it is exact in short
    rational numbers, and zeros where there is nothing but rounding, so that what is decoupled stays decoupled. Raises
    NumPy's LinAlgError where it is not found.
    """
    Q, R = set_weight(state_set), input_weight * set_weight(input_set)
    A, B = system.A / rate, system.B / rate
    P = scipy.linalg.solve_discrete_are(A, B, Q, R)
    K = -np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    if not np.all(np.isfinite(K)):
        raise np.linalg.LinAlgError("the regulator is not finite")
    sizes = np.abs(K) * unit_scales(state_set) / unit_scales(input_set)[:, None]
    mantissas, exponents = np.frexp(np.where(sizes > _NOTHING * np.max(sizes), K, 0.0))
    return np.asarray(np.ldexp(np.round(np.ldexp(mantissas, _BITS)), exponents - _BITS))


def room(
    system: LinearSystem, state_set: Polytope, input_set: Polytope, disturbance: DisturbanceSet, K: Array
) -> float:
    """Return the least part of a width that the errors leave, in float64: negative where they leave nothing."""
    rows, widths = np.vstack([state_set.rows, input_set.rows @ K]), bound_widths(state_set, input_set)
    reach = errors_reach(closed_loop(system, K), disturbance, np.vstack([rows, -rows]), unit_scales(state_set))
    return float(np.min(1 - (reach[: len(rows)] + reach[len(rows) :]) / widths, initial=1.0))


def bound_widths(state_set: Polytope, input_set: Polytope) -> Array:
    """Return the widths between all bounds, those of states first."""
    return np.concatenate([state_set.widths, input_set.widths])


def set_weight(bounded: Polytope) -> Array:
    """Return Σ (row / width)² as a matrix (n, n), plus a little in units of the coordinates, so that none is free."""
    weight = squares_in_widths(bounded) + _FREE * np.diag(1 / unit_scales(bounded) ** 2)
    return np.asarray((weight + weight.T) / 2)
