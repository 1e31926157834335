"""Step 2 of the proof in float64 for Matérn kernels: all centres before a box, and all after it, from their moments.

The mathematics is that of `kernels.matern`. What a single centre adds is a polynomial times e^(−λt), and so is the sum
over all centres before a box: it takes a few moments instead of all centres. The moments at b ≥ a follow from those at
a: with d = λ (b − a), they are e^(−d) Σ_j m_j d^(k−j)/(k−j)!, and the centres between a and b are added. Nothing
cancels here that does not cancel in the sum over centres: no other factor is negative.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from trackably.checker.arithmetic.intervals import ONE, total
from trackably.checker.floats.intervals import Array, Floats, joined, sums
from trackably.checker.kernels.base import geometric_rest

Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class CentresBefore:
    """The first centres of Σ_i c_i κ(t − t_i), which are in order [s]: for each box those `before` all its times.

    `middles` and signed half widths `along` [s] of the B boxes; with time reversed, these are negative.
    """

    kernel: Any  # a `Matern`; its formulas are for intervals of mpmath, and for arrays of intervals
    centres: Array
    weights: Array
    before: Indices
    middles: Floats
    along: Floats

    def enclose(self, radii: Floats, n: int) -> tuple[Floats, Floats]:
        """Return coefficients, (n, B), and what they miss, (B,)."""
        last = np.maximum(self.before - 1, 0)
        at, which = np.unique(last, return_inverse=True)
        is_any, half = self.before > 0, abs(self.along)
        time = self.middles - Floats.exact(self.centres[last])
        x = self.kernel.rate * time.choose(is_any, time, half)
        moments = [m.choose(is_any, m.at((slice(None), which)), 0.0) for m in self.moments(at)]
        terms = self.kernel.along([m.at(0) for m in moments], x, self.kernel.rate * self.along, n)
        ratio: Any = half / radii
        largest = self.kernel.largest_around([m.at(1) for m in moments], x, self.kernel.rate * radii)
        return joined([c.at(None) for c in terms], axis=0), largest * geometric_rest(ratio, n)

    def moments(self, at: Indices) -> list[Floats]:
        """Return m_0, m_1, … of the weights, and of their sizes, at the centres with these rising indices: (2, K)."""
        anchors, counts, used = self.centres[at], np.diff(at, prepend=-1), slice(0, at[-1] + 1)
        weights, v = self.weights[used], self._distances(np.repeat(anchors, counts), self.centres[used])
        part = (-v).exp() * Floats.exact(np.stack([weights, np.abs(weights)]))
        found: list[Floats] = []
        for k in range(self.kernel.degree + 1):
            found.append(sums(part, at - counts + 1, int(counts.max())))
            part = part * v / (k + 1)
        step = 1  # each moment is that of the centres since so many anchors
        while step < len(at):
            earlier = [m.at((slice(None), slice(-step))) for m in found]
            moved = _moved(earlier, self._distances(anchors[step:], anchors[:-step]))
            parts = [(m.at((slice(None), slice(step))), m.at((slice(None), slice(step, None)))) for m in found]
            found = [joined([first, others + more]) for (first, others), more in zip(parts, moved, strict=True)]
            step *= 2
        return found

    def _distances(self, later: Array, earlier: Array) -> Floats:
        found: Floats = self.kernel.rate * (Floats.exact(later) - Floats.exact(earlier))
        return found


def _moved(moments: list[Floats], d: Floats) -> list[Floats]:
    """Return moments of the same centres at anchors that are d/λ later."""
    powers: list[Any] = [ONE]
    for k in range(1, len(moments)):
        powers.append(powers[-1] * d / k)
    fall = (-d).exp()
    return [fall * total(m * powers[k - j] for j, m in enumerate(moments[: k + 1])) for k in range(len(moments))]
