"""The times at which a constraint has to hold, and where on them it is closest to failing."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pipeline.arrays import Array


class IndexSet(Protocol):
    """A set of times [s]."""

    def local_minima(self, margin: Callable[[Array], Array]) -> Array:
        """Times of the set at which `margin` has its local minima, in increasing order."""


@dataclass(frozen=True)
class Steps:
    """The instants k T_s for k = first … last."""

    first: int
    last: int
    sampling_time: float

    def local_minima(self, margin: Callable[[Array], Array]) -> Array:
        times = np.arange(self.first, self.last + 1, dtype=float) * self.sampling_time
        values = np.concatenate([[np.inf], margin(times), [np.inf]])
        # A plateau counts once, by its first instant.
        return np.asarray(times[(values[1:-1] < values[:-2]) & (values[1:-1] <= values[2:])])
