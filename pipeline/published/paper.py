"""Numbers of the paper, printed or computed from its curves, and a counterexample to its Lemma 2."""

import csv
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import linprog, minimize_scalar

from pipeline.published.scalar import coefficients, interval_sets, scalar
from trackably.arrays import Array, root_mean_square
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference

_PRINTED = Path("data/paper/printed_numbers.csv")


def printed_numbers(experiment: str) -> dict[str, float]:
    """Return the printed values of an experiment by quantity."""
    with _PRINTED.open(newline="", encoding="utf-8") as file:
        return {row["quantity"]: float(row["value"]) for row in csv.DictReader(file) if row["experiment"] == experiment}


def period_of_curve(times: Array, values: Array, between: tuple[float, float], harmonics: int) -> tuple[float, float]:
    """Return the period [s] of the Fourier sum that fits a curve best, and the root mean square of the residual.

    `times` [s] and `values` have shape (n,); entries without a value (NaN) are left out. The period is searched in
    `between` [s]; the sum has a constant and `harmonics` harmonics.
    """
    known = np.isfinite(values)
    t, y = times[known], values[known]

    def left(period: float) -> float:
        angles = 2 * np.pi / period * t[:, None] * np.arange(harmonics + 1)
        basis = np.concatenate([np.cos(angles), np.sin(angles[:, 1:])], axis=1)
        return root_mean_square(y - basis @ np.linalg.lstsq(basis, y)[0])

    best = minimize_scalar(left, bounds=between, method="bounded", options={"xatol": 1e-9})
    return float(best.x), float(best.fun)


def states_behind(plant: ConstrainedSystem, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return the smallest and largest states that have given growth rates [1/s]: Assumption 5 solved for x.

    The system has a < 1 and b > 0.
    """
    (a, b, c), (_, inputs), t_s = coefficients(plant), interval_sets(plant), plant.sampling_time
    return (b * inputs.lower + c - t_s * lower) / (1 - a), (b * inputs.upper + c - t_s * upper) / (1 - a)


def reach_in_intervals(times: Array, derivative: Array, edges: Array) -> Array:
    """Return max − min of a curve in each interval between `edges` [s], from its derivative at `times`: shape (η,)."""
    curve = cumulative_trapezoid(np.nan_to_num(derivative), times, initial=0)
    inside = [(times >= a - 1e-9) & (times <= b + 1e-9) for a, b in pairwise(edges)]
    return np.array([np.ptp(curve[i]) for i in inside])


SYSTEM = scalar(3.0, 1.0, state_set=Interval(-1.0, 1.0), input_set=Interval(-1.0, 1.0), sampling_time=0.2726)
EDGES = (0.0, 0.5, 1.0)
"""η = 2 intervals of the period of 1 s."""

_T = SYSTEM.sampling_time
_KERNEL = Periodic(signal_std=1.0, lengthscale=1.5, period=1.0)
_CENTRES = np.arange(7) / 7
_WORST = 0.37
"""The time [s], of a hundred that were tried, at which the input of a reference that keeps (8) can be largest."""
_TIMES_EACH = 60
_ROOM = 3e-3
"""How much the bounds of (8) are tightened, so that they also hold between the times of the linear program."""


def reference_between_intervals() -> Reference:
    """Return the reference with the largest input at one time among those that keep (8).

    It is a sum of seven periodic kernels, and a linear program finds its weights. In each interval all pairs (t, s)
    keep -1 ≤ T_s ṁ⁺(t) - 2 m⁺(s) ≤ 1, which is (8) for a = 3 and b = 1.
    """
    inside = [np.linspace(start, end, _TIMES_EACH) for start, end in pairwise(EDGES)]
    pairs = np.concatenate([_T * _basis(t, 1)[:, None] - 2 * _basis(t, 0) for t in inside]).reshape(-1, _CENTRES.size)
    now, later = _basis(np.array([_WORST, _WORST + _T]), 0)
    found = linprog(3 * now - later, np.vstack([pairs, -pairs]), np.full(2 * len(pairs), 1 - _ROOM), bounds=(-9, 9))
    return Reference((KernelSum(_KERNEL, 0.0, _CENTRES, np.asarray(found.x)),), SYSTEM)


def _basis(t: Array, order: int) -> Array:
    """Return the derivatives of an `order` of the kernels at times t [s]: shape (times, centres)."""
    return np.asarray(_KERNEL.jet(t[:, None] - _CENTRES, order)[order])
