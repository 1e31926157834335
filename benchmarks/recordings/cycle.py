"""A drive cycle: stops, accelerations, cruising, braking; the speed [m/s] of a car, and noisy samples of it."""

import numpy as np

from trackably.arrays import Array
from trackably.gp.samples import Samples

NOISE = 0.1  # m/s
_FINE, _SMOOTH = 0.05, 3.0  # s


def drive_cycle(count: int = 1200, seed: int = 0) -> tuple[Samples, Array]:
    """Return samples of the speed at every second, and the true speeds there.

    The car stands still for a quarter of the time. Its accelerations are at most 2 m/s²: corners of the trace are
    rounded by a moving average over 3 s.
    """
    draw = np.random.default_rng(seed)
    corners, speeds = _trace(draw, float(count))
    fine = np.arange(-_SMOOTH, count + _SMOOTH, _FINE)
    window = round(_SMOOTH / _FINE)
    smooth = np.convolve(np.interp(fine, corners, speeds), np.ones(window) / window, "same")
    times = np.arange(float(count))
    truth = np.interp(times, fine, smooth)
    return Samples(times, truth + NOISE * draw.standard_normal(count)), truth


def _trace(draw: np.random.Generator, duration: float) -> tuple[list[float], list[float]]:
    """Return times [s] and speeds [m/s] between which the speed is linear."""
    times, speeds = [0.0], [0.0]

    def drive(speed: float, then: float) -> None:
        """Change to a `speed` by up to 2 m/s², and hold it for some time."""
        reached = times[-1] + abs(speed - speeds[-1]) / draw.uniform(0.6, 2.0)
        times.extend([reached, reached + then])
        speeds.extend([speed, speed])

    while times[-1] < duration:
        drive(0.0, draw.uniform(10, 40))
        for _ in range(draw.integers(1, 4)):
            drive(draw.uniform(5, 30), draw.uniform(5, 40))
    return times, speeds
