"""The true signals from which samples are drawn; learning never uses the signals themselves."""

from collections.abc import Callable

import numpy as np

from trackably.arrays import Array
from trackably.gp.samples import Samples


def setpoint_change(t: Array) -> Array:
    """Return r = sin(2π t) − 1 until 0.25 s, then 0, of Example 1 (T_s = 0.01 s: sin(πk/50) − 1 for k < 25)."""
    # Compare with half a millisecond less, so that k T_s = 0.25 counts as reached however it is rounded.
    return np.asarray(np.where(t < 0.25 - 5e-4, np.sin(2 * np.pi * t) - 1, 0.0))


def two_harmonics(t: Array) -> Array:
    """Return r = sin(2t) + sin(4t + 1)/2, of period π s, of Example 2."""
    return np.asarray(np.sin(2 * t) + 0.5 * np.sin(4 * t + 1))


def docking_x(t: Array) -> Array:
    """Return the position [m] of a vehicle that starts 3 m behind the origin and comes to rest there in 5 s."""
    left = 1 - np.clip(t / 5, 0, 1)
    return np.asarray(-3 * left**2 * (3 - 2 * left))


def docking_y(t: Array) -> Array:
    """Return the position [m] to the side of the same vehicle, which drives around an obstacle."""
    return np.asarray(1.2 * np.sin(np.pi * np.clip(t / 5, 0, 1)) ** 2)


_ROUND = 20.0
"""The duration of one round of the figure eight [s]."""


def eight_x(t: Array) -> Array:
    """Return the position [m] along a figure eight that is driven once in 20 s, with 0.4 to 0.9 m/s."""
    return np.asarray(2 * np.sin(2 * np.pi * t / _ROUND))


def eight_y(t: Array) -> Array:
    """Return the position [m] across the same figure eight: two waves in each round."""
    return np.asarray(np.sin(4 * np.pi * t / _ROUND))


GroundTruth = Callable[[Array], Array]
"""A signal over time [s]."""

GROUND_TRUTHS: dict[str, GroundTruth] = {
    "setpoint_change": setpoint_change,
    "two_harmonics": two_harmonics,
    "docking_x": docking_x,
    "docking_y": docking_y,
    "eight_x": eight_x,
    "eight_y": eight_y,
}


def draw(truth: GroundTruth, times: Array, noise_std: float, seed: int) -> Samples:
    """Return samples at `times` [s] with independent normal noise from NumPy's default generator."""
    noise = noise_std * np.random.default_rng(seed).standard_normal(times.size)
    return Samples(times, truth(times) + noise)
