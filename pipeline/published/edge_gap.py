"""A reference that keeps program (8) of the paper and cannot be followed: the gap of its Lemma 2."""

from itertools import pairwise

import numpy as np
from scipy.optimize import linprog

from pipeline.published.scalar import scalar
from trackably.arrays import Array
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.signal import KernelSum
from trackably.systems.reference import Reference
from trackably.systems.sets.interval import Interval

SYSTEM = scalar(3.0, 1.0, state_set=Interval(-1.0, 1.0), input_set=Interval(-1.0, 1.0), sampling_time=0.2726)
EDGES = (0.0, 0.5, 1.0)
"""η = 2 intervals of the period of 1 s."""

_T = SYSTEM.sampling_time
_KERNEL = Periodic(signal_std=1.0, lengthscale=1.5, period=1.0)
_CENTRES = np.arange(7) / 7
_WORST = 0.37
"""The time [s] at which the input is as large as (8) lets it be, found by trying a hundred."""
_TIMES_EACH = 60
_ROOM = 3e-3
"""The part of (8)'s bounds that is kept free, for times between those of the linear program."""


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
    """Return the kernels' derivatives of this order: shape (times, centres)."""
    return np.asarray(_KERNEL.jet(t[:, None] - _CENTRES, order)[order])
