"""The times at which a constraint has to hold, and where on them it is closest to failing."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from trackable.arrays import Array
from trackable.gp.kernels.base import Kernel

# A signal cannot turn much faster than its kernel's correlation time: this many looks at each are enough to see every
# dip that refinement then follows to its bottom.
_LOOKS_PER_CORRELATION_TIME = 12
_FEWEST_LOOKS, _MOST_LOOKS = 64, 50_000
_REFINEMENTS, _NARROWER = 4, 0.1
_FEW_STEPS = 4096  # to look at all of them costs no more than to choose among them
_PARTS = 16  # of the steps around a dip: at the ends of each there is a look


class IndexSet(ABC):
    """A set of times [s]; what it is may depend on the signals' kernels, whose period is learned."""

    @abstractmethod
    def local_minima(self, margin: Callable[[Array], Array], kernels: Sequence[Kernel]) -> Array:
        """Times of the set at which `margin` has its local minima, in increasing order."""

    def overlooked(
        self, margin: Callable[[Array], Array], kernels: Sequence[Kernel], curvature: Callable[[], float]
    ) -> Array:
        """Local minima below zero where `local_minima` may have left some out: where a set holds times one by one.

        The margin is the smaller one of some functions whose second derivatives are no larger than `curvature` [1/s²].
        """
        return np.empty(0)


@dataclass(frozen=True)
class Steps(IndexSet):
    """The instants k T_s for k = first … last.

    Where they are many, local minima are found as those of a continuum are: by looks that are close enough to each
    other, and closer ones around each dip.
    """

    first: int
    last: int
    sampling_time: float

    def local_minima(self, margin: Callable[[Array], Array], kernels: Sequence[Kernel]) -> Array:
        looks = self._looks(kernels)
        dips = _dips(margin(looks * self.sampling_time))
        if self._are_few(looks):
            return np.asarray(looks[dips] * self.sampling_time)
        at = looks[dips]
        before, after = looks[np.maximum(dips - 1, 0)], looks[np.minimum(dips + 1, len(looks) - 1)]
        while np.any(np.maximum(at - before, after - at) > 1):
            closer = np.rint(np.linspace(before, after, _PARTS + 1))
            lowest = np.argmin(margin(closer * self.sampling_time), axis=0)
            pick = np.arange(len(at))
            at = closer[lowest, pick]
            before, after = closer[np.maximum(lowest - 1, 0), pick], closer[np.minimum(lowest + 1, _PARTS), pick]
        return np.asarray(np.unique(at) * self.sampling_time)

    def overlooked(
        self, margin: Callable[[Array], Array], kernels: Sequence[Kernel], curvature: Callable[[], float]
    ) -> Array:
        looks = self._looks(kernels)
        if self._are_few(looks):
            return np.empty(0)
        steps, values, most = [looks], [margin(looks * self.sampling_time)], curvature()
        edges, at_edges = np.stack([looks[:-1], looks[1:]]), np.stack([values[0][:-1], values[0][1:]])
        while True:
            # Between two times that lie h apart a function is at most h²/8 times its curvature below the lower one.
            before, after = edges[:-1].ravel(), edges[1:].ravel()
            lower = np.minimum(at_edges[:-1], at_edges[1:]).ravel()
            apart = np.maximum(after - before, 1) * self.sampling_time
            unsure = (after - before > 1) & (lower < most * apart**2 / 8)
            if not np.any(unsure):
                break
            edges = np.rint(np.linspace(before[unsure], after[unsure], _PARTS + 1))
            at_edges = margin(edges * self.sampling_time)
            steps.append(edges.ravel())
            values.append(at_edges.ravel())
        met, first = np.unique(np.concatenate(steps), return_index=True)
        margins = np.concatenate(values)[first]
        dips = _dips(margins)
        return np.asarray(met[dips[margins[dips] < 0]] * self.sampling_time)

    @property
    def _all(self) -> Array:
        return np.arange(self.first, self.last + 1, dtype=float)

    def _looks(self, kernels: Sequence[Kernel]) -> Array:
        """The steps to look at first: all, where they are few."""
        count = self.last - self.first + 1
        looks = _looks((count - 1) * self.sampling_time, kernels)
        if count <= max(_FEW_STEPS, looks + 1):
            return self._all
        return np.unique(np.rint(np.linspace(self.first, self.last, looks + 1)))

    def _are_few(self, looks: Array) -> bool:
        return len(looks) == self.last - self.first + 1


@dataclass(frozen=True)
class Window(IndexSet):
    """All real times from `start` to `end` [s]."""

    start: float
    end: float

    def local_minima(self, margin: Callable[[Array], Array], kernels: Sequence[Kernel]) -> Array:
        return _refined_minima(margin, self.start, self.end, kernels)


@dataclass(frozen=True)
class AllPhases(IndexSet):
    """All real times of signals whose kernels are periodic: one common period as it is at the moment.

    A time found here stays a time of the set when the period moves.
    """

    period: Callable[[Sequence[Kernel]], float]

    def local_minima(self, margin: Callable[[Array], Array], kernels: Sequence[Kernel]) -> Array:
        return _refined_minima(margin, 0.0, self.period(kernels), kernels)


def _refined_minima(margin: Callable[[Array], Array], start: float, end: float, kernels: Sequence[Kernel]) -> Array:
    """Local minima of a continuous margin: dips of a grid, each followed down by ever narrower parabolas."""
    times = np.linspace(start, end, _looks(end - start, kernels) + 1)
    values, reach = margin(times), times[1] - times[0]
    dips = _dips(values)
    at = times[dips]
    for _ in range(_REFINEMENTS):
        centre = np.clip(at, start + reach, end - reach)  # at an end the parabola leans inwards
        left, middle, right = margin(np.concatenate([centre - reach, centre, centre + reach])).reshape(3, -1)
        with np.errstate(invalid="ignore"):  # where a margin is infinite the dip stays as it was found
            curvature = left - 2 * middle + right
            step = np.divide(
                reach / 2 * (left - right), curvature, out=at - centre, where=np.isfinite(curvature) & (curvature > 0)
            )
        at, reach = np.clip(centre + step, centre - reach, centre + reach), reach * _NARROWER
    at = np.clip(at, start, end)
    at = np.where(margin(at) < values[dips], at, times[dips])
    return np.asarray(np.unique(at))


def _looks(length: float, kernels: Sequence[Kernel]) -> int:
    """How many looks a stretch of time of this `length` [s] needs."""
    looks = _LOOKS_PER_CORRELATION_TIME * length / min(kernel.correlation_time for kernel in kernels)
    return int(np.clip(looks, _FEWEST_LOOKS, _MOST_LOOKS))


def _dips(values: Array) -> npt.NDArray[np.intp]:
    """Indices of the local minima of a sequence, ends included; a plateau counts once, by its first entry."""
    walled = np.concatenate([[np.inf], values, [np.inf]])
    return np.flatnonzero((walled[1:-1] < walled[:-2]) & (walled[1:-1] <= walled[2:]))
