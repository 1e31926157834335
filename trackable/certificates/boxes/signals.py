"""Enclose shifted signals in many boxes at once: Taylor polynomials and bounds of their errors, in float64.

The mathematics is that of `kernels.base` and `enclosure`, and so is the direction of every bound. The differences: all
numbers are balls of float64, and centres that are out of reach are one bound, Σ_i |c_i| sup |κ|. If their series were
summed, their remainders would be no larger than that bound times `rest`, which is added for this reason: who sums them
finds an enclosure that is no wider.
"""

from dataclasses import dataclass

import numpy as np

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.boxes.boxes import Boxes
from trackable.certificates.boxes.nearby import Pairs, Summands
from trackable.certificates.floats.balls import Balls, Mask, U, sums_up
from trackable.certificates.floats.series import Series
from trackable.certificates.kernels.base import BEYOND_HALF


def missed(summands: Summands, boxes: Boxes, terms: int) -> Array:
    """Bound the error of the Taylor polynomial of a shifted signal in each box, and which part of it is due to kinks.

    The first row is the bound, infinite where there is none; the second one is a part of the first: shape (2, B).
    """
    with np.errstate(all="ignore"), ball_arithmetic(terms):
        rest, (reach, outside) = _rest(boxes.halves.highest / boxes.radii, terms), summands.reach(boxes)
        smooth = summands.total * outside * (1 + rest)
        kinked = np.zeros(len(boxes))
        for block, pairs in summands.pairs(boxes, reach):
            mirrored = _Mirrored.of(summands, pairs)
            smooth[block] += _smooth(summands, pairs, mirrored, rest[block])
            if summands.kernel.kinks:
                kinked[block] = _kinked(summands, pairs, mirrored, terms)
        found = np.stack([sums_up(smooth + kinked, 4), kinked])
        return np.where(np.isnan(found), np.inf, found)


def polynomials(summands: Summands, boxes: Boxes, terms: int) -> Balls:
    """Return the Taylor polynomials of a shifted signal in the boxes, without what `missed` bounds."""
    mid, rad = np.zeros((2, terms, len(boxes)))
    with np.errstate(all="ignore"), ball_arithmetic(terms):
        for block, pairs in summands.pairs(boxes, summands.reach(boxes)[0]):
            mirrored, half = _Mirrored.of(summands, pairs), boxes.at(block).halves.at(pairs.of_box)
            series = summands.kernel.taylor(Series.of([mirrored.r, half * mirrored.signs], terms))
            count = int(np.max(np.bincount(pairs.of_box)))
            off = series.rad + (count + 4) * U * np.abs(series.mid)
            mid[: len(series), block] = pairs.summed(series.mid * pairs.weights)
            rad[: len(series), block] = sums_up(pairs.summed(off * np.abs(pairs.weights)), count)
    return Balls(mid, rad)


@dataclass(frozen=True, eq=False)
class _Mirrored:
    """Differences r of the middles and the centres, mirrored to r ≥ 0 by these `signs`, as κ is even.

    `both` says where some times of the box may lie before the centre and some after it. There either sign will do.
    """

    r: Balls
    signs: Array
    both: Mask

    @classmethod
    def of(cls, summands: Summands, pairs: Pairs) -> "_Mirrored":
        boxes, at, shift = pairs.boxes, pairs.of_box, summands.shift
        r = shift.differences(boxes.middles.at(at), pairs.centres)
        signs, both = np.where(r.mid >= 0, 1.0, -1.0), np.zeros(len(at), dtype=bool)
        if summands.kernel.kinks:
            near = np.flatnonzero(np.abs(r.mid) <= 2 * boxes.halves.highest[at] + 4 * r.rad)
            after = shift.signs(boxes.starts[at[near]], pairs.centres[near]) >= 0
            before = shift.signs(boxes.ends[at[near]], pairs.centres[near]) <= 0
            signs[near] = np.where(after, 1.0, np.where(before, -1.0, signs[near]))
            both[near] = ~(after | before)
        return cls(Balls(r.mid * signs, r.rad), signs, both)


def _smooth(summands: Summands, pairs: Pairs, mirrored: _Mirrored, rest: Array) -> Array:
    """Bound Σ_i |c_i| times what each Taylor polynomial leaves out of the branch of its middle."""
    size = summands.kernel.on_disc(mirrored.r, Balls.exact(pairs.boxes.radii[pairs.of_box])).highest
    return pairs.summed_up(np.broadcast_to(size, mirrored.r.mid.shape) * rest[pairs.of_box])


def _kinked(summands: Summands, pairs: Pairs, mirrored: _Mirrored, terms: int) -> Array:
    """Bound Σ_i |c_i| times how far κ is from the branch of the middle."""
    r, half, at = mirrored.r, pairs.boxes.halves.at(pairs.of_box), np.flatnonzero(mirrored.both)
    jumps = Balls.of(summands.kernel.jump(r, half)).highest
    found = np.array(np.broadcast_to(jumps, r.mid.shape))
    radius = Balls.exact(pairs.boxes.radii[pairs.of_box[at]])
    found[at] += _oddness(summands, r.at(at), half.at(at), radius, terms)
    return pairs.summed_up(found)


def _oddness(summands: Summands, r: Balls, half: Balls, radius: Balls, terms: int) -> Array:
    """Bound |κ₊(y) − κ₊(−y)| up to where the branch κ₊ of y ≥ 0 is continued beyond the kink.

    The mirrored middle is at r, so that it is continued by half − r, or by less. Infinite if r is on another branch.
    """
    kernel = summands.kernel
    reach = Balls.exact(np.maximum((half - r).highest, (half * BEYOND_HALF).highest))
    rest = _rest(reach.mid / radius.mid, terms) * kernel.on_disc(Balls.exact(np.zeros_like(r.mid)), radius).highest
    odd = kernel.taylor(Series.of([Balls.exact(np.zeros_like(r.mid)), reach], terms)).coefficients.size[1::2]
    same_branch = Balls.of(kernel.jump(Balls.exact(np.zeros_like(r.mid)), abs(r))).is_zero()
    return np.where(same_branch, 2 * (sums_up(np.sum(odd, axis=0), terms) + rest) * (1 + 8 * U), np.inf)


def _rest(ratio: Array, terms: int) -> Array:
    """Over-estimate Σ_(k ≥ terms) ratioᵏ."""
    ratio = np.asarray(ratio * (1 + 2 * U))
    return np.where(ratio < 1, ratio**terms / (1 - ratio) * (1 + (terms + 16) * 2 * U), np.inf)
