"""Bounds of the error of evaluating a signal in float64, by the formulas of its kernel in trackable.gp."""

import numpy as np
from flint import arb

from trackable.certificates.kernels.table import balls_of
from trackable.gp.signal import KernelSum


def signal_error(signal: KernelSum, latest: arb, ahead: arb) -> tuple[arb, arb]:
    """Bound |float64 − exact| and |z| of a signal at t + s, up to `latest` [s], with shifts s up to `ahead` [s]."""
    n, u = signal.weights.size, arb(2) ** -53
    weight = sum((abs(arb(c)) for c in signal.weights.tolist()), arb(0))
    centre = arb(float(np.max(np.abs(signal.centres))))
    kernel = balls_of(signal.kernel).sensitivity(2 * (latest + centre))
    # t = k T, s = j T, t + s and r = t + s − t_i are rounded once each, by u times their sizes at most. With
    # |t + s| ≤ |r| + |t_i| and |t| ≤ |r| + |t_i| + s this is less than 3 u (|r| + |t_i| + s), also where t and s
    # cancel. Each formula sees r itself with up to 6 more relative roundings.
    one = kernel.formula + 10 * kernel.stretch + 4 * (centre + ahead) * kernel.slope + (n + 4) * kernel.size
    size = abs(arb(signal.mean)) + weight * kernel.size
    return u * (weight * one + 4 * size), size
