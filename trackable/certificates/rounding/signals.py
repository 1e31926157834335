"""Bounds of the error of evaluating a signal in float64, by the formulas of its kernel in trackable.gp."""

import numpy as np
from flint import arb

from trackable.certificates.kernels.table import balls_of
from trackable.gp.signal import KernelSum


def signal_error(signal: KernelSum, latest: arb) -> tuple[arb, arb]:
    """Bound |float64 − exact| and |z| of a signal at times up to `latest` [s]."""
    n, u = signal.weights.size, arb(2) ** -53
    weight = sum((abs(arb(c)) for c in signal.weights.tolist()), arb(0))
    centre = arb(float(np.max(np.abs(signal.centres))))
    kernel = balls_of(signal.kernel).sensitivity(2 * (latest + centre))
    # r̂ is off by 3 u (|r| + |t_i|) at most, and each formula sees r itself with up to 6 more relative roundings.
    one = kernel.formula + 10 * kernel.stretch + 4 * centre * kernel.slope + (n + 4) * kernel.size
    size = abs(arb(signal.mean)) + weight * kernel.size
    return u * (weight * one + 4 * size), size
