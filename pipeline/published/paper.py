"""Numbers printed in the paper, from data/paper, and numbers computed from its printed curves."""

import csv
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import minimize_scalar

from pipeline.published.scalar import coefficients, interval_sets
from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem

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
        return float(np.sqrt(np.mean((y - basis @ np.linalg.lstsq(basis, y)[0]) ** 2)))

    best = minimize_scalar(left, bounds=between, method="bounded", options={"xatol": 1e-9})
    return float(best.x), float(best.fun)


def states_behind(plant: ConstrainedSystem, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return the smallest and largest states behind growth rates [1/s]: Assumption 5, solved for x (a < 1, b > 0)."""
    (a, b, c), (_, inputs), t_s = coefficients(plant), interval_sets(plant), plant.sampling_time
    return (b * inputs.lower + c - t_s * lower) / (1 - a), (b * inputs.upper + c - t_s * upper) / (1 - a)


def reach_in_intervals(times: Array, derivative: Array, edges: Array) -> Array:
    """Return max − min of a curve in each interval between `edges` [s], from its derivative at `times`: shape (η,)."""
    curve = cumulative_trapezoid(np.nan_to_num(derivative), times, initial=0)
    inside = [(times >= a - 1e-9) & (times <= b + 1e-9) for a, b in pairwise(edges)]
    return np.array([np.ptp(curve[i]) for i in inside])
