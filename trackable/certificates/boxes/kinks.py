"""Bound what it costs to continue a branch of a kernel beyond its kinks, in many boxes at once, in float64."""

import numpy as np

from trackable.arrays import Array
from trackable.certificates.boxes.boxes import ShiftedBoxes
from trackable.certificates.boxes.mirrored import Mirrored
from trackable.certificates.boxes.nearby import Summands
from trackable.certificates.floats.balls import Balls, U, sums_up
from trackable.certificates.floats.series import Series
from trackable.certificates.kernels.base import BEYOND_HALF, KernelBalls


def beyond_kinks(summands: Summands, shifted: ShiftedBoxes, reach: Array, terms: int) -> Array:
    """Bound Σ_i |c_i| times how far κ is from the branch of each box's middle, for the centres within reach: (B,)."""
    kernel, boxes = summands.kernel, shifted.boxes
    found, crossed = np.zeros((2, len(boxes)))
    if not kernel.kinks:
        return found
    rounded = np.zeros(len(boxes))
    first = 0
    for pairs in summands.pairs(shifted, reach):
        of, block = Mirrored.of(kernel, pairs), slice(first, first + len(pairs.boxes))
        first = block.stop
        crossed[block] = pairs.summed_up(np.where(of.both, _on_their_branch(kernel, of), 0.0))
        rounded[block] = pairs.largest(of.r.rad)
        if len(kernel.kinks) > 1:
            found[block] = pairs.summed_up(kernel.jump(of.r, of.halves).highest)
    # A mirrored middle may be negative by rounding.
    most = np.maximum(boxes.halves.highest + rounded, (boxes.halves * BEYOND_HALF).highest) * (1 + 2 * U)
    oddness = _oddness(kernel, Balls.exact(most), Balls.exact(boxes.radii), terms)
    # An unknown one (∞ times a weight of 0) stays unknown.
    return sums_up(found + np.where(crossed == 0, 0.0, crossed * oddness), 4)


def _on_their_branch(kernel: KernelBalls, of: Mirrored) -> Array:
    """Return 1 where the branch of the middle is that of the kink at 0, whose odd powers are bounded; elsewhere ∞."""
    if len(kernel.kinks) == 1:
        return np.ones(len(of.signs))
    zeros = Balls.exact(np.zeros(len(of.signs)))
    return np.where(kernel.jump(zeros, abs(of.r)).is_zero(), 1.0, np.inf)


def _oddness(kernel: KernelBalls, reach: Balls, radius: Balls, terms: int) -> Array:
    """Bound |κ₊(y) − κ₊(−y)| for 0 ≤ y ≤ reach, where κ₊ is the branch of positive differences."""
    zeros = Balls.exact(np.zeros_like(reach.mid))
    rest = rest_of(reach.mid / radius.mid, terms) * kernel.on_disc(zeros, radius).highest
    odd = kernel.taylor(Series.of([zeros, reach], terms)).coefficients.size[1::2]
    return np.asarray(2 * (sums_up(np.sum(odd, axis=0), terms) + rest) * (1 + 8 * U))


def rest_of(ratio: Array, terms: int) -> Array:
    """Over-estimate Σ_(k ≥ terms) ratioᵏ; the ratio may be rounded."""
    ratio = np.asarray(ratio * (1 + 2 * U))
    return np.where(ratio < 1, ratio**terms / (1 - ratio) * (1 + (terms + 16) * 2 * U), np.inf)
