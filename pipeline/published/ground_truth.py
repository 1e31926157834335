"""The signals behind samples that are drawn: known to whoever draws them, never to the learner."""

from collections.abc import Callable

import numpy as np

from trackable.arrays import Array
from trackable.gp.samples import Samples


def setpoint_change(t: Array) -> Array:
    """Example 1: r = sin(2π t) − 1 until 0.25 s, then 0 (with T_s = 0.01 s: sin(πk/50) − 1 for k < 25)."""
    # Half a millisecond of slack lets k T_s = 0.25, rounded either way, count as reached.
    return np.asarray(np.where(t < 0.25 - 5e-4, np.sin(2 * np.pi * t) - 1, 0.0))


def two_harmonics(t: Array) -> Array:
    """Example 2: r = sin(2t) + sin(4t + 1)/2, of period π s."""
    return np.asarray(np.sin(2 * t) + 0.5 * np.sin(4 * t + 1))


def docking_x(t: Array) -> Array:
    """A vehicle that comes to rest at the origin in 5 s, from 3 m behind it: the way ahead [m]."""
    left = 1 - np.clip(t / 5, 0, 1)
    return np.asarray(-3 * left**2 * (3 - 2 * left))


def docking_y(t: Array) -> Array:
    """The same vehicle, around something in its way: to the side [m]."""
    return np.asarray(1.2 * np.sin(np.pi * np.clip(t / 5, 0, 1)) ** 2)


GroundTruth = Callable[[Array], Array]
"""A signal over time [s]."""

GROUND_TRUTHS: dict[str, GroundTruth] = {
    "setpoint_change": setpoint_change,
    "two_harmonics": two_harmonics,
    "docking_x": docking_x,
    "docking_y": docking_y,
}


def draw(truth: GroundTruth, times: Array, noise_std: float, seed: int) -> Samples:
    """Return samples at `times` [s] with independent normal noise from NumPy's default generator."""
    noise = noise_std * np.random.default_rng(seed).standard_normal(times.size)
    return Samples(times, truth(times) + noise)
