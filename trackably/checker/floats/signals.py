"""Step 2 of the proof in float64: Taylor models of a shifted signal in many boxes of time at once.

The mathematics is that of `kernels`, by the same formulas. A signal at the shift s is Σ_i c_i κ(t + s − t_i). Centres
are near a box or far from it. For the far ones, |Σ_i c_i κ(t + s − t_i)| ≤ Σ_i |c_i| sup_{|r| ≥ d} |κ(r)| at all times
of the box, where d is less than their distances. Whether a kink is inside a box is decided in rational arithmetic.

For a Matérn kernel, only centres inside a box are expanded one by one. The kernel of a centre before the box is a
polynomial times e^(−λt), and so is the sum over all of these centres; likewise after the box. Such a sum takes a few
moments m_k (`kernels`) instead of all centres, and is expanded in their place; on the disc of Cauchy's estimate, where
|κ| ≤ M, it is bounded by Σ |c_i| M. The moments at b ≥ a follow from those at a: with d = λ (b − a), they are e^(−d)
Σ_j m_j d^(k−j)/(k−j)!, plus those of the centres between a and b. Nothing cancels here that does not cancel in the sum
over centres: only c_i may be negative.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from trackably.checker.boxes import Box
from trackably.checker.floats.intervals import Array, Floats, stack, sums
from trackably.checker.intervals import ONE, ZERO, Real, ratio, total
from trackably.checker.kernels import Matern, geometric_rest
from trackably.checker.models import Model
from trackably.checker.subject import Signal
from trackably.checker.watch import tick

Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class CentresBefore:
    """The part of Σ_i c_i κ(t − t_i) whose centres are before a box; `centres` [s] are in increasing order."""

    kernel: Any  # a `Matern`; its formulas accept intervals of mpmath and arrays of intervals alike
    centres: Array
    weights: Array

    def enclose(self, before: Indices, middles: Floats, along: Floats, radii: Floats, n: int) -> Model:
        """Return Taylor models with n terms, in B boxes, of the sum over all centres before each box.

        For box b, these are the first before[b] centres. `middles` [s] and half widths `along` [s] are those of the
        boxes; with time reversed, half widths are negative. `radii` [s] are those of discs in Cauchy's estimate.
        """
        last, is_any, half = np.maximum(before - 1, 0), before > 0, abs(along)
        time = middles - Floats.exact(self.centres[last])
        x = self.kernel.rate * time.choose(is_any, time, radii)  # for no centres, any time with finite results
        moments = [m.choose(is_any, m.at((slice(None), last)), 0.0) for m in self.moments]
        terms = self.kernel.along([m.at(0) for m in moments], x, self.kernel.rate * along, n)
        ratio: Any = half / radii
        largest = self.kernel.largest_around([m.at(1) for m in moments], x, self.kernel.rate * radii)
        return Model(terms, largest * geometric_rest(ratio, n))

    @cached_property
    def moments(self) -> list[Floats]:
        """The moments m_0, m_1, … at each of the N centres, of all centres up to this one; each has the shape (2, N).

        The first row has the moments of the weights, the second row those of the absolute weights. They are the same
        for all boxes, so that what is shown of a box does not depend on which boxes are examined together with it.
        """
        low, step = np.zeros((len(self.kernel.p), 2, len(self.centres))), 1
        low[0] = self.weights, np.abs(self.weights)
        found = [Floats(*ends) for ends in zip(low, low.copy(), strict=True)]
        while step < len(self.centres):  # `found` has, at each centre, the moments of the last `step` ones
            tick()
            since = self.kernel.rate * (Floats.exact(self.centres[step:]) - Floats.exact(self.centres[:-step]))
            moved = _move([m.at((slice(None), slice(-step))) for m in found], since)
            for m, more in zip(found, moved, strict=True):
                both = m.at((slice(None), slice(step, None))) + more
                m.low[:, step:], m.high[:, step:] = both.low, both.high
            step *= 2
        return found


def _move(moments: list[Floats], d: Floats) -> list[Floats]:
    """Return the moments of the same centres about later times: e^(−d) Σ_(j ≤ k) m_j d^(k−j)/(k−j)! for m_0, m_1, …

    For centres t_i and weights c_i, the moments about a time a are m_k = Σ_i c_i v_iᵏ/k! e^(−v_i) with v_i = λ (a −
    t_i). The new times are later by d/λ [s].
    """
    powers: list[Any] = [ONE]
    for k in range(1, len(moments)):
        powers.append(powers[-1] * d / k)
    fall = (-d).exp()
    return [fall * total(m * powers[k - j] for j, m in enumerate(moments[: k + 1])) for k in range(len(moments))]


_PAIRS = 4096
"""Pairs of a box and a centre that are enclosed at once, so that they fit the cache."""


@dataclass(frozen=True, eq=False)
class Boxes:
    """B boxes, the times from `starts` to `ends` [s], with `radii` [s] of discs in Cauchy's estimate; shapes (B,).

    In box b, signals are enclosed at t + s for the times t of the box, with the rational number s = `shifts`[b] [s].
    """

    starts: Array
    ends: Array
    radii: Array
    shifts: Sequence[Fraction]

    @cached_property
    def moves(self) -> Floats:
        """Intervals that contain the shifts s [s], one for each box."""
        known = {shift: Floats.of(ratio(shift)) for shift in {*self.shifts}}
        return stack([known[shift] for shift in self.shifts], ())

    @cached_property
    def middles(self) -> Floats:
        """The middles of the boxes, plus the shifts [s]."""
        return (Floats.exact(self.starts) + Floats.exact(self.ends)) / 2 + self.moves

    @cached_property
    def halves(self) -> Floats:
        """Half of the widths of the boxes [s]."""
        return (Floats.exact(self.ends) - Floats.exact(self.starts)) / 2


@dataclass(frozen=True, eq=False)
class ManyCentres:
    """Σ_i c_i κ(t − t_i), centres in increasing order; those farther than `reach` [s] from a box add at most `far`.

    For a Matérn kernel both are zero, because centres outside of a box are summed by their moments.
    """

    kernel: Any  # a `Kernel`; its formulas accept intervals of mpmath and arrays of intervals alike
    centres: Array
    weights: Array
    reach: float
    far: Real

    @staticmethod
    @lru_cache(maxsize=8)
    def of(signal: Signal) -> "ManyCentres":
        """Return z − m, a sum of kernels, for a signal z with mean m; its centres are sorted.

        Results are cached, so that moments (weighted sums over all earlier centres) are computed once for each signal.
        """
        centres, weights = np.array(signal.centres), np.array(signal.weights)
        order = np.argsort(centres, kind="stable")
        reach, far = (0.0, ZERO) if isinstance(signal.kernel, Matern) else (signal.reach.distance, signal.far.size)
        return ManyCentres(signal.kernel, centres[order], weights[order], reach, far)

    def models(self, boxes: Sequence[Box], shifts: Sequence[Fraction], n: int) -> Floats:
        """Return Taylor models with n terms at S shifts in B boxes, (S, n + 1, B); last rows bound the remainders."""
        moved, (starts, ends, radii) = (
            [shift for shift in shifts for _ in boxes],
            np.tile(np.array(boxes).T, len(shifts)),
        )
        found = self.enclose(Boxes(starts, ends, radii, moved), n)
        rows = stack([*found.coefficients, found.missed], (len(moved),))
        return Floats(*(end.reshape(n + 1, len(shifts), -1).swapaxes(0, 1) for end in (rows.low, rows.high)))

    def enclose(self, boxes: Boxes, n: int) -> Model:
        """Return Taylor models with n terms in the boxes, as arrays of intervals of shape (B,)."""
        sides: Any = None  # how many centres no time of a box is before, and how many some time of it is after
        if self.kernel.has_kink:
            sides = self.passed(boxes.starts, boxes, "right"), self.passed(boxes.ends, boxes, "left")
        first, stop = self._near(boxes, sides)
        before = np.concatenate([[0], np.cumsum(stop - first)])  # before[b] pairs (box, centre) are of boxes before b
        ends, radii = np.zeros((2, n + 1, len(first))), Floats.exact(boxes.radii)
        for begin in range(0, int(before[-1]), _PAIRS):
            tick()
            pairs = np.arange(begin, min(begin + _PAIRS, int(before[-1])))
            of_box = np.searchsorted(before, pairs, side="right") - 1
            which = first[of_box] + pairs - before[of_box]
            r = boxes.middles.at(of_box) - Floats.exact(self.centres[which])
            is_past = sides and (which >= sides[1][of_box], which < sides[0][of_box])
            each = self.kernel.model(r, boxes.halves.at(of_box), radii.at(of_box), n, is_past)
            each = each.times(Floats.exact(self.weights[which]))
            some, begins = np.unique(of_box, return_index=True)
            part = sums(stack([*each.coefficients, each.missed], of_box.shape), begins)
            both = Floats(*ends[:, :, some]) + part
            ends[:, :, some] = both.low, both.high
        every: Any = [Floats(low, high) for low, high in zip(*ends, strict=True)]
        found = Model(every[:n], every[n] + self.far)
        return found + self._outside(boxes, first, stop, n) if isinstance(self.kernel, Matern) else found

    def passed(self, times: Array, boxes: Boxes, side: Literal["left", "right"]) -> Indices:
        """Return for each box how many centres are before times[b] + shifts[b], or for "right" not after it.

        This is exact: float64 intervals decide, and rational arithmetic where a centre is too near to the time.
        """
        exact, moved = Floats.exact(times), Floats.exact(times) + boxes.moves
        near = moved.choose((boxes.moves.low == 0) & (boxes.moves.high == 0), exact, moved)
        least, most = (np.searchsorted(self.centres, end, side) for end in (near.low, near.high))
        for b in np.flatnonzero(least < most).tolist():
            bisect = bisect_left if side == "left" else bisect_right
            least[b] = bisect(self.centres, Fraction(times[b].item()) + boxes.shifts[b], least[b], most[b])
        return least

    def _near(self, boxes: Boxes, sides: tuple[Indices, Indices] | None) -> tuple[Indices, Indices]:
        """Return, for each box, the indices of two centres: the first that is not certainly before the box by `reach`,
        and the first after it that is certainly after the box by as much.

        Only the centres from the first index to just before the second may be nearer. For a Matérn kernel, only these
        centres are inside of the box: `sides` say how many are not after its start, and how many are before its end.
        """
        if sides and isinstance(self.kernel, Matern):
            return sides[0], np.maximum(*sides)
        start, end = (Floats.exact(times) + boxes.moves for times in (boxes.starts, boxes.ends))
        first = np.searchsorted(self.centres, (start - self.reach).low, side="right")
        return first, np.maximum(np.searchsorted(self.centres, (end + self.reach).high), first)

    def _outside(self, boxes: Boxes, first: Indices, stop: Indices, n: int) -> Model:
        """Return models of the sums over all centres before and after each box, for a Matérn kernel.

        Centres with indices below `first` are before the box, and centres from the index `stop` on are after it.
        """
        (left, right), radii = self._one_sided, Floats.exact(boxes.radii)
        before = left.enclose(first, boxes.middles, boxes.halves, radii, n)
        return before + right.enclose(len(self.centres) - stop, -boxes.middles, -boxes.halves, radii, n)

    @cached_property
    def _one_sided(self) -> tuple[CentresBefore, CentresBefore]:
        """The sums over centres before a box and after it; with time reversed, those after a box are before it."""
        reversed_time = CentresBefore(self.kernel, -self.centres[::-1], self.weights[::-1])
        return CentresBefore(self.kernel, self.centres, self.weights), reversed_time
