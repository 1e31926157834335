"""Index sets: the times at which a constraint has to hold, and the local minima of its margin there."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.checker.certificate import AllPhases, Window
from trackably.gp.joint import JointPosterior, period_of
from trackably.gp.kernels.base import Kernel
from trackably.systems.trajectories import Quantities

# A signal cannot change much within a small part of its kernel's correlation time. So a grid with this many points in
# each correlation time shows every local minimum, which is then refined.
_POINTS_PER_CORRELATION_TIME = 12
_FEWEST_POINTS, _MOST_POINTS = 64, 50_000  # the least and the largest number of intervals of a grid
_REFINEMENTS, _NARROWER = 3, 0.1  # number of parabolas that refine a minimum; the width of each relative to the last
_FEW_STEPS = 4096  # with more steps, evaluating all of them takes longer than a search in real time
AROUND = np.array([[-1], [0], [1]])  # where a parabola is fitted: distances from its centre, in units of `reach`

TimesAndMargins = tuple[Array, Array]
"""Times [s] of local minima in increasing order, and the margins there: shape (n,) both."""


class IndexSet(ABC):
    """A set of times [s]. It may depend on the kernels of the signals, because their period may be learned."""

    @property
    def none(self) -> Array:
        """An empty array of places (members of the set): shape (0,) for times."""
        return np.empty(0)

    @abstractmethod
    def minima_of_each(self, margins: Quantities, kernels: Sequence[Kernel]) -> list[TimesAndMargins]:
        """Return, for each margin, the times [s] of its local minima in the set, and its values there."""

    def nearest(self, t: Array) -> Array:
        """Return the times of the set that are nearest to t [s]; t must lie between its first and its last time."""
        return t

    @property
    @abstractmethod
    def ends(self) -> tuple[float, float]:
        """The first and the last time of the set [s]."""


class SeveralTimes(IndexSet):
    """A set whose members, called places, are rows of several times [s], for quantities that depend on all of these."""

    @abstractmethod
    def value_and_gradient(self, posterior: JointPosterior, places: Array) -> tuple[Array, Array]:
        """Return the quantity at n places, and its derivatives ∂/∂ln θ_j: shapes (n,) and (p, n).

        Undefined values are NaN or infinite.
        """


@dataclass(frozen=True)
class Steps(IndexSet):
    """The instants k T_s for k = `first` … `last`.

    Margins are evaluated at all of these. If there are many, and kernels are analytic, they are evaluated only beside
    the local minima in real time.
    """

    first: int
    last: int
    sampling_time: float

    def minima_of_each(self, margins: Quantities, kernels: Sequence[Kernel]) -> list[TimesAndMargins]:
        if self.last - self.first > _FEW_STEPS and all(kernel.is_analytic for kernel in kernels):
            found = _minima_in_cells(margins, *self.ends, kernels)
            return [self._lowest_beside(margins, q, at) for q, (at, _) in enumerate(found)]
        times = np.arange(self.first, self.last + 1, dtype=float) * self.sampling_time
        values = margins.margins(times)
        return [(times[are], of[are]) for are, of in zip(_are_minima(values), values, strict=True)]

    def _lowest_beside(self, margins: Quantities, q: int, at: Array) -> TimesAndMargins:
        """Return the margin with the index `q` at the steps nearest to the times `at` [s], and these steps' times [s].

        Of each nearest step and its two neighbours, the one with the lowest margin is taken.
        """
        beside = self.nearest(np.clip(at + self.sampling_time * AROUND, *self.ends))
        values = margins.margins_of(np.full(len(at), q), beside)
        return _in_order(*lowest_of_each(beside, values))

    def nearest(self, t: Array) -> Array:
        return np.asarray(np.rint(t / self.sampling_time) * self.sampling_time)

    @property
    def ends(self) -> tuple[float, float]:
        return self.first * self.sampling_time, self.last * self.sampling_time


@dataclass(frozen=True)
class RealTimes(IndexSet):
    """All real times of a `Window`; or, with `AllPhases`, all real times, if kernels have one common period.

    With `AllPhases`, local minima are searched in [0, period], as all other times repeat these. The search raises
    TypeError for kernels without a common period.
    """

    of: Window | AllPhases

    def minima_of_each(self, margins: Quantities, kernels: Sequence[Kernel]) -> list[TimesAndMargins]:
        start, end = self.of.span if isinstance(self.of, Window) else (0.0, period_of(kernels))
        return _minima_in_cells(margins, start, end, kernels)

    @property
    def ends(self) -> tuple[float, float]:
        return self.of.span


def _minima_in_cells(margins: Quantities, start: float, end: float, kernels: Sequence[Kernel]) -> list[TimesAndMargins]:
    """Return the local minima of each margin, searched separately between times at which bounds may jump or bend."""
    inner = margins.breakpoints_in(start, end).tolist()
    cells = [_refined_minima(margins, a, b, kernels) for a, b in pairwise([start, *inner, end])]
    if len(cells) == 1:
        return cells[0]
    return [_in_order(*map(np.concatenate, zip(*of, strict=True))) for of in zip(*cells, strict=True)]


def _refined_minima(margins: Quantities, start: float, end: float, kernels: Sequence[Kernel]) -> list[TimesAndMargins]:
    """Return the local minima of continuous margins: those on a grid, refined by parabolas."""
    times = np.linspace(start, end, _grid_intervals(end - start, kernels) + 1)
    values, reach = margins.margins(times), times[1] - times[0]
    which, grid = np.nonzero(_are_minima(values))
    inner = np.clip(grid, 1, len(times) - 2)  # at an end of the grid, the parabola goes through three points inside
    at, centre, beside = times[grid], times[inner], values[which, inner + AROUND]
    at, refined = _lowest_of_parabolas(at, centre, reach, beside)
    for _ in range(_REFINEMENTS - 1):
        reach *= _NARROWER
        centre = np.clip(at, start + reach, end - reach)
        at, refined = _lowest_of_parabolas(at, centre, reach, margins.margins_of(which, centre + reach * AROUND))
    at, lowest = np.clip(at, start, end), values[which, grid]
    at, lowest = np.where(refined < lowest, at, times[grid]), np.fmin(refined, lowest)
    ends = np.searchsorted(which, np.arange(len(values) + 1)).tolist()
    return [_in_order(at[first:last], lowest[first:last]) for first, last in pairwise(ends)]


def _lowest_of_parabolas(at: Array, centre: Array, reach: Array | float, beside: Array) -> TimesAndMargins:
    """Fit n parabolas to the values `beside` (3, n) at centre − reach, centre and centre + reach.

    Return the times and values of the parabolas' minima. Each time is at most `reach` away from its centre. Where a
    parabola has no minimum, the time is `at`.
    """
    left, middle, right = beside
    with np.errstate(invalid="ignore"):  # where a margin is infinite, the minimum on the grid stays
        slope, curvature = (right - left) / 2, left - 2 * middle + right
        is_valley = (curvature > 0) & (curvature < np.inf)
        step = np.divide(-slope, curvature, out=(at - centre) / reach, where=is_valley)
        step = np.minimum(np.maximum(step, -1.0), 1.0)
        return centre + reach * step, middle + step * (slope + step / 2 * curvature)


def lowest_of_each(times: Array, margins: Array) -> TimesAndMargins:
    """Return the time of the lowest margin in each column, and that margin."""
    lowest, every = np.argmin(margins, axis=0), np.arange(margins.shape[1])
    return times[lowest, every], margins[lowest, every]


def _in_order(times: Array, margins: Array) -> TimesAndMargins:
    """Return the times in increasing order without duplicates, with their margins."""
    if np.all(times[1:] > times[:-1]):
        return times, margins
    once, first = np.unique(times, return_index=True)
    return once, margins[first]


def _grid_intervals(length: float, kernels: Sequence[Kernel]) -> int:
    """Return into how many equal intervals a window of this `length` [s] is divided to search for local minima.

    The number grows with the window's length in correlation times of the fastest kernel, within limits.
    """
    wanted = _POINTS_PER_CORRELATION_TIME * length / min(kernel.correlation_time for kernel in kernels)
    return int(np.clip(wanted, _FEWEST_POINTS, _MOST_POINTS))


def _are_minima(values: Array) -> npt.NDArray[np.bool_]:
    """Mark the local minima of sequences (…, n), ends included; of a plateau only its first entry counts."""
    are = values < np.inf
    are[..., 1:] &= values[..., 1:] < values[..., :-1]
    are[..., :-1] &= values[..., :-1] <= values[..., 1:]
    return are
