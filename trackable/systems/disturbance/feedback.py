"""Feedback against disturbances: given, or the linear-quadratic regulator that leaves the most of the bounds."""

import numpy as np
import scipy

from trackable.arguments import numbers
from trackable.arrays import Array, ArrayLike
from trackable.systems.disturbance.decay import NoInvariantSetError, closed_loop, errors_reach
from trackable.systems.disturbance.sets import DisturbanceSet
from trackable.systems.linear import LinearSystem
from trackable.systems.sets.polytope import Polytope

INPUT_WEIGHTS = tuple(10.0**exponent for exponent in range(-4, 5))
_FREE = 1e-6
_BITS = 20


def given_feedback(feedback: ArrayLike, system: LinearSystem) -> Array:
    """Return a feedback K (m, n) that somebody chose. ValueError: its shape is another, or it is not finite."""
    K = numbers("feedback", feedback)
    n, m = system.B.shape
    if K.shape != (m, n) or not np.all(np.isfinite(K)):
        raise ValueError(f"feedback: K must be a finite matrix of shape ({m}, {n}), got {K.tolist()}")
    return K


def best_feedback(system: LinearSystem, state_set: Polytope, input_set: Polytope, disturbance: DisturbanceSet) -> Array:
    """Return the K (m, n) that leaves the most room among linear-quadratic regulators with some weights of the input.

    Room is what Z leaves between two bounds, as a part of their distance, for the row where that is least; of equal
    rooms the smallest weight counts. Errors are weighted in units of the sets. Raises NoInvariantSetError where no
    regulator makes the error decay.
    """
    found: list[tuple[float, Array]] = []
    for weight in INPUT_WEIGHTS:
        try:
            K = regulator(system, state_set, input_set, weight)
            found.append((room(system, state_set, input_set, disturbance, K), K))
        except (np.linalg.LinAlgError, NoInvariantSetError):  # other weights may do
            continue
    if not found:
        raise NoInvariantSetError("feedback: no linear-quadratic regulator was found; give a feedback K of your own")
    return max(found, key=lambda candidate: candidate[0])[1]


def regulator(system: LinearSystem, state_set: Polytope, input_set: Polytope, input_weight: float) -> Array:
    """Return K of min Σ ‖x‖²_Q + `input_weight` ‖u‖²_R, with Q and R in units of the sets, in few binary digits.

    So K is exact in short rational numbers. Raises NumPy's LinAlgError where it is not found.
    """
    Q, R = set_weight(state_set), input_weight * set_weight(input_set)
    P = scipy.linalg.solve_discrete_are(system.A, system.B, Q, R)
    K = -np.linalg.solve(R + system.B.T @ P @ system.B, system.B.T @ P @ system.A)
    if not np.all(np.isfinite(K)):
        raise np.linalg.LinAlgError("the regulator is not finite")
    mantissas, exponents = np.frexp(K)
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
    return np.concatenate([state_set.upper - state_set.lower, input_set.upper - input_set.lower])


def unit_scales(bounded: Polytope) -> Array:
    """Return a unit for each coordinate (n,): how far it may move alone inside its set; 1 where nothing bounds it."""
    sizes = np.abs(bounded.rows)
    reach = np.divide((bounded.upper - bounded.lower)[:, None], sizes, out=np.full_like(sizes, np.inf), where=sizes > 0)
    least = np.min(reach, axis=0, initial=np.inf)
    return np.where(np.isfinite(least), least, 1.0)


def set_weight(bounded: Polytope) -> Array:
    """Return Σ (row / width)² as a matrix (n, n), plus a little in units of the coordinates, so that none is free."""
    rows = bounded.rows / (bounded.upper - bounded.lower)[:, None]
    weight = rows.T @ rows + _FREE * np.diag(1 / unit_scales(bounded) ** 2)
    return np.asarray((weight + weight.T) / 2)
