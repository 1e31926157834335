"""Joint trajectories in float64: the limits that are certainly kept, and the jumps that are certainly small.

The mathematics is that of `joints`. With M the matrix from powers of x to Bernstein coefficients, b = M a, and a
polynomial lies between the least and the largest entry of b for 0 ≤ x ≤ 1. Each a_k takes less than k + 8 roundings, an
entry of M one, and a sum of n + 1 products n + 1: b is off by less than (2 n + 20) u |M| |a| ≤ 2⁻⁴⁴ |M| |a| with
u = 2⁻⁵³ and n < 100, and by 2⁻¹⁰⁰⁰ for what underflows, as h^k does not: it is between 2⁻⁹⁰⁰ and 2⁹⁰⁰. Where
that does not decide, polynomials are halved in float64 intervals (`polynomials`).
"""

from math import perm

import numpy as np

from trackably.checker.floats.intervals import Array, Floats
from trackably.checker.floats.polynomials import bernstein, stay_between
from trackably.checker.joints import JointTrajectory, Open, everything
from trackably.checker.watch import tick

_PART, _TINY, _RANGE = 2.0**-44, 2.0**-1000, 2.0**900


def undecided(trajectory: JointTrajectory) -> tuple[Open, Open]:
    """Return the limits and the jumps of which float64 does not know whether they are kept."""
    lengths = {len(c) for rows in trajectory.coefficients for c in rows}
    ends = np.array(trajectory.breakpoints)
    widths = np.diff(ends)
    extreme = _RANGE ** (1 / max(lengths))
    if len(lengths) > 1 or not np.all((widths > 1 / extreme) & (widths < extreme)):
        return everything(trajectory)
    with np.errstate(all="ignore"):  # what is not finite is not decided
        c = np.array(trajectory.coefficients)  # joints, pieces, powers
        limits: list[tuple[int, int, int]] = []
        jumps: list[tuple[int, int, int]] = []
        for r in range(len(trajectory.jumps) + 1):
            tick()
            a, b, off = _bernstein(c, widths, r)
            limits += _open_limits(trajectory, r, b, off)
            if r < len(trajectory.jumps):
                jumps += _open_jumps(trajectory, r, a, b, off)
    return limits, jumps


def _bernstein(c: Array, widths: Array, r: int) -> tuple[Array, Array, Array]:
    """Return a_0 on each piece, (J, K), the Bernstein coefficients of a derivative, (J, K, n), and their errors."""
    n = max(c.shape[2] - r, 1)
    powers = c[:, :, r:] if c.shape[2] > r else np.zeros((*c.shape[:2], 1))
    factors = np.array([float(perm(k + r, r)) for k in range(n)])
    a = powers * factors * widths[:, None] ** np.arange(float(n))
    M = bernstein(n)
    return a[:, :, 0], a @ M.T, _PART * (np.abs(a) @ M.T) + _TINY


def _open_limits(trajectory: JointTrajectory, r: int, b: Array, off: Array) -> list[tuple[int, int, int]]:
    some, (joints, pieces, n) = [joint.limits[r] or (-np.inf, np.inf) for joint in trajectory.joints], b.shape
    rest = [(j, r, pieces) for j, (low, high) in enumerate(some) if trajectory.rests and r and not low <= 0 <= high]
    near = Floats((b - off).reshape(-1, n).T, (b + off).reshape(-1, n).T)
    kept = stay_between(near, *(np.repeat(ends, pieces) for ends in zip(*some, strict=True)))
    left = np.argwhere(~kept.reshape(joints, pieces)).tolist()
    return rest + [(j, r, i) for j, i in left if trajectory.joints[j].limits[r]]


def _open_jumps(trajectory: JointTrajectory, r: int, a: Array, b: Array, off: Array) -> list[tuple[int, int, int]]:
    count = len(trajectory.inner)
    rest = np.zeros((len(a), 1)) if r else b[:, -1:, -1]
    after = np.concatenate([a[:, 1:], rest], axis=1)[:, :count]
    jump = np.abs(after - b[:, :count, -1]) * (1 + _PART) + off[:, :count, -1] * 2 + _PART * np.abs(after)
    return [
        (j, r, i + 1)
        for j, i in np.argwhere(~(jump <= trajectory.jumps[r])).tolist()
        if r < trajectory.joints[j].order and not _is_end(trajectory, r, i)
    ]


def _is_end(trajectory: JointTrajectory, r: int, i: int) -> bool:
    """Whether this is the position at the end, which rests there by definition."""
    return r == 0 and i + 2 == len(trajectory.breakpoints)
