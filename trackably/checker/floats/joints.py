"""Joint trajectories in float64: the limits that are certainly kept, and the jumps that are certainly small.

The mathematics is that of `joints`. With M the matrix from powers of x to Bernstein coefficients, b = M a, and a
polynomial lies between the least and the largest entry of b for 0 ≤ x ≤ 1. Each a_k takes less than k + 8 roundings, an
entry of M one, and a sum of n + 1 products n + 1: b is off by less than (2 n + 20) u |M| |a| ≤ 2⁻⁴⁴ |M| |a| with
u = 2⁻⁵³ and n < 100, and by 2⁻¹⁰⁰⁰ for what underflows, as h^k does not: it is between 2⁻⁹⁰⁰ and 2⁹⁰⁰. Halves
of a polynomial have averages of b: in each halving n + 1 sums of numbers of the size of b are rounded.
"""

from functools import cache
from math import comb, perm

import numpy as np
import numpy.typing as npt

from trackably.checker.joints import JointTrajectory, Open, everything
from trackably.checker.watch import tick

Array = npt.NDArray[np.float64]

_PART, _TINY, _RANGE = 2.0**-44, 2.0**-1000, 2.0**900
_HALVINGS = 8


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
    M = _matrix(n)
    return a[:, :, 0], a @ M.T, _PART * (np.abs(a) @ M.T) + _TINY


def _open_limits(trajectory: JointTrajectory, r: int, b: Array, off: Array) -> list[tuple[int, int, int]]:
    some = [joint.limits[r] or (-np.inf, np.inf) for joint in trajectory.joints]
    low, high = (np.array(ends)[:, None] for ends in zip(*some, strict=True))
    error = np.max(off, axis=2) * (1 + _PART)
    margin = _PART * np.where(np.isfinite(low + high), np.abs(low) + np.abs(high), 0.0) + error
    rest = [(j, r, b.shape[1]) for j, (of, to) in enumerate(some) if trajectory.rests and r and not of <= 0 <= to]
    kept = (np.min(b, axis=2) - margin >= low) & (np.max(b, axis=2) + margin <= high)
    left = np.argwhere(~kept)
    if not len(left):
        return rest
    at = tuple(left.T)
    open_ = ~_kept_in_halves(b[at], margin[at], low[at[0], 0], high[at[0], 0])
    return rest + [(j, r, i) for j, i in left[open_].tolist() if trajectory.joints[j].limits[r]]


def _kept_in_halves(b: Array, error: Array, low: Array, high: Array) -> npt.NDArray[np.bool_]:
    """Return which of these polynomials, (P, n), are inside their limits on each part, as these are halved."""
    of, lost, left = np.arange(len(b)), np.zeros(len(b), dtype=bool), _half(b.shape[1])
    for _ in range(_HALVINGS):
        tick()
        error = error + _PART * np.max(np.abs(b), axis=1)
        b = np.concatenate([b @ left.T, (b[:, ::-1] @ left.T)[:, ::-1]])
        of, error = np.tile(of, 2), np.tile(error, 2)
        inside = (np.min(b, axis=1) - error >= low[of]) & (np.max(b, axis=1) + error <= high[of])
        ends = b[:, [0, -1]]
        outside = ~((np.min(ends, axis=1) - error >= low[of]) & (np.max(ends, axis=1) + error <= high[of]))
        lost[of[outside]] = True
        going = ~inside & ~lost[of]
        b, of, error = b[going], of[going], error[going]
        if not len(b):
            break
    lost[of] = True
    return ~lost


def _open_jumps(trajectory: JointTrajectory, r: int, a: Array, b: Array, off: Array) -> list[tuple[int, int, int]]:
    count = len(trajectory.inner)
    rest = np.zeros((len(a), 1)) if r else b[:, -1:, -1]
    after = np.concatenate([a[:, 1:], rest], axis=1)[:, :count]
    jump = np.abs(after - b[:, :count, -1]) * (1 + _PART) + off[:, :count, -1] * 2 + _PART * np.abs(after)
    return [
        (j, r, i + 1) for j, i in np.argwhere(~(jump <= trajectory.jumps[r])).tolist() if not _is_end(trajectory, r, i)
    ]


def _is_end(trajectory: JointTrajectory, r: int, i: int) -> bool:
    """Whether this is the position at the end, which rests there by definition."""
    return r == 0 and i + 2 == len(trajectory.breakpoints)


@cache
def _matrix(n: int) -> Array:
    """Return the Bernstein coefficients of x^k, k < n, in degree n − 1: entry (i, k) is C(i, k)/C(n − 1, k)."""
    return np.array([[comb(i, k) / comb(n - 1, k) for k in range(n)] for i in range(n)])


@cache
def _half(n: int) -> Array:
    """Return what takes Bernstein coefficients to those of the left half (de Casteljau)."""
    return np.array([[comb(i, k) / 2.0**i for k in range(n)] for i in range(n)])
