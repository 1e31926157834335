"""Enclose shifted signals in many boxes at once: Taylor polynomials and bounds of their errors, in float64.

The mathematics is that of `kernels.base` and `enclosure`, and so is the direction of every bound. The differences: all
numbers are balls of float64, and centres that are out of reach are one bound, Σ_i |c_i| sup |κ|. If their series were
summed, their remainders would be no larger than that bound times `rest`, which is added for this reason: who sums them
finds an enclosure that is no wider.
"""

from collections.abc import Iterator

import numpy as np

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.boxes import exponentials, gaussians
from trackable.certificates.boxes.boxes import ShiftedBoxes
from trackable.certificates.boxes.kinks import beyond_kinks, rest_of
from trackable.certificates.boxes.mirrored import Mirrored
from trackable.certificates.boxes.nearby import Summands
from trackable.certificates.floats.balls import Balls, joined, sums_up
from trackable.certificates.floats.series import Series
from trackable.certificates.kernels.base import KernelBalls
from trackable.certificates.kernels.matern import MaternBalls
from trackable.certificates.kernels.squared_exponential import SquaredExponentialBalls


def missed(summands: Summands, shifted: ShiftedBoxes, terms: int) -> Array:
    """Bound the error of the Taylor polynomial of a shifted signal in each box; infinite for too small discs: (B,)."""
    with np.errstate(all="ignore"), ball_arithmetic(terms):
        boxes, (reach, outside) = shifted.boxes, summands.reach(shifted)
        size, far = _on_discs(summands, shifted, reach), summands.total * outside
        rest = rest_of(boxes.halves.highest / boxes.radii, terms)
        kinked = beyond_kinks(summands, shifted, reach, terms)
        found = sums_up((size + far) * rest + far + kinked, 4)
        return np.where(np.isnan(found), np.inf, found)


def polynomials(summands: Summands, shifted: ShiftedBoxes, terms: int) -> Balls:
    """Return the Taylor polynomials of a shifted signal in the boxes, without what `missed` bounds: (terms, B).

    What is out of reach is in the radii, too: only of many boxes is there such a reach, and `missed` may have been
    asked about few of them.
    """
    with np.errstate(all="ignore"), ball_arithmetic(terms):
        reach, outside = summands.reach(shifted)
        found = _within(summands, shifted, reach, terms)
        if not np.any(outside):
            return found
        rad = found.rads.copy()
        rad[0] = sums_up(rad[0] + summands.total * outside, 2)
        return Balls(found.mid, rad)


def _within(summands: Summands, shifted: ShiftedBoxes, reach: Array, terms: int) -> Balls:
    """Return the Taylor polynomials of the sums over all centres within reach: shape (terms, B)."""
    boxes, kernel = shifted.boxes, summands.kernel
    if isinstance(kernel, SquaredExponentialBalls):
        of_blocks = (gaussians.sums(kernel, each, terms) for each in summands.pairs_or_all(shifted, reach))
        return gaussians.polynomial(kernel, joined(of_blocks), boxes)
    blocks = _blocks(summands, shifted, reach)
    if not isinstance(kernel, MaternBalls):
        return joined(_series(kernel, each, terms) for each in blocks)
    before, after = zip(*(_sums_by_sign(kernel, each) for each in blocks), strict=True)
    left, right = exponentials.polynomial(kernel, joined(before), -1.0, boxes, terms), joined(after)
    return left + exponentials.polynomial(kernel, right, 1.0, boxes, terms)


def _blocks(summands: Summands, shifted: ShiftedBoxes, reach: Array) -> Iterator[Mirrored]:
    return (Mirrored.of(summands.kernel, pairs) for pairs in summands.pairs(shifted, reach))


def _on_discs(summands: Summands, shifted: ShiftedBoxes, reach: Array) -> Array:
    """Bound Σ_i |c_i| |κ| on the discs around all centres within reach: shape (B,)."""
    kernel = summands.kernel
    if isinstance(kernel, SquaredExponentialBalls):
        return np.concatenate([gaussians.size_on_discs(kernel, each) for each in summands.pairs_or_all(shifted, reach)])
    blocks = _blocks(summands, shifted, reach)
    if isinstance(kernel, MaternBalls):
        sums = [exponentials.sums(kernel, abs(each.r), np.abs(each.pairs.weights), each.pairs) for each in blocks]
        return exponentials.size_on_discs(kernel, joined(sums), shifted.boxes)
    return np.concatenate([each.pairs.summed_up(kernel.on_disc(each.r, each.radii).highest) for each in blocks])


def _series(kernel: KernelBalls, of: Mirrored, terms: int) -> Balls:
    """Return Σ_i c_i κ(r_i + h x) as polynomials in x: shape (terms, B)."""
    found = kernel.taylor(Series.of([of.r, of.halves * of.signs], terms)).coefficients
    weighted = of.pairs.weighted(found, of.pairs.weights)
    zeros = np.zeros((terms - len(weighted.mid), len(of.pairs.boxes)))
    return Balls(np.concatenate([weighted.mid, zeros]), np.concatenate([weighted.rad, zeros]))


def _sums_by_sign(kernel: MaternBalls, of: Mirrored) -> tuple[Balls, Balls]:
    """Return the sums for boxes before their centres, and for those after them."""
    weights = of.pairs.weights
    before = exponentials.sums(kernel, of.r, np.where(of.signs < 0, weights, 0.0), of.pairs)
    return before, exponentials.sums(kernel, of.r, np.where(of.signs > 0, weights, 0.0), of.pairs)
