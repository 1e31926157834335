"""What interpolates to given sample times: found once for a number of points, whatever the hyperparameters."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from trackable.arrays import Array
from trackable.gp.factors import chebyshev
from trackable.gp.factors.factored import Covariance

ROUNDING = 4 * float(np.finfo(float).eps)  # of a covariance, as a part of its largest value: less is not resolved
_SEEN = 7 / 8  # of the coefficients: the others have to be nothing but rounding
_KEPT = 4  # bases: those that the iterates of an optimiser need in turns


class Basis(NamedTuple):
    """W = ϱ Q R for relative noise ϱ: times [s] of the `points` (m,), Q (n, m) and R (m, m) upper triangular."""

    points: Array
    q: Array
    r: Array


@dataclass(frozen=True)
class Bases:
    """Those of samples at `times` [s] from 0 to `span`, with a `relative_noise` each, as they are asked for."""

    times: Array
    relative_noise: Array
    span: float
    _known: dict[int, Basis] = field(default_factory=dict, init=False, repr=False)

    def of(self, count: int) -> Basis:
        """With so many points."""
        found = self._known.pop(count, None) or self._made(count)
        self._known[count] = found  # the last one is the one used last
        if len(self._known) > _KEPT:
            del self._known[next(iter(self._known))]
        return found

    def points_for(self, covariance: Covariance, most: int) -> int | None:
        """How many points resolve a covariance and its derivatives, all up to ROUNDING; None where `most` do not.

        How well e^(iωt) is interpolated does not depend on the other time: two of those are enough to see all ω.
        """
        points = chebyshev.nodes(0.0, self.span, most)
        value, gradient = covariance(points - np.array([[0.0], [self.span / 2]]))
        rows = np.concatenate([value[None], gradient])
        sizes = np.abs(chebyshev.coefficients(rows)) > ROUNDING * np.max(np.abs(rows), axis=(1, 2), keepdims=True)
        degree = max(np.flatnonzero(sizes.any(axis=(0, 1))).tolist(), default=most)
        # What reaches beyond the last coefficients folds back onto them: it must not be taken for resolved.
        count = _rounded_up(degree + 2)
        return count if count <= most and degree < _SEEN * most else None

    def _made(self, count: int) -> Basis:
        matrix = chebyshev.interpolation(self.times, 0.0, self.span, count)
        q, r = np.linalg.qr(matrix / self.relative_noise[:, None])
        return Basis(chebyshev.nodes(0.0, self.span, count), q, r)


def _rounded_up(count: int) -> int:
    """To one of two steps for each doubling: optimisers wander, and a basis is to serve more than once."""
    step = 1 << max(0, count.bit_length() - 2)
    return -(-count // step) * step
