"""How far a reference is from the samples that it was learned from."""

import math
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.gp.samples import Samples

# A reference follows its samples unless it is further off than all of these.
_TIMES_UNCONSTRAINED = 3.0
_TIMES_NOISE = 1.0
_OF_SPREAD = 0.1


@dataclass(frozen=True, eq=False)
class Misfit:
    """The samples called `name`, minus the reference (`off`) and minus the `unconstrained` fit, each of shape (n,).

    `noise_std` is σ_n of the reference, `noise_unconstrained` that of the unconstrained fit, learned from the samples
    if `is_learned` holds. Where the samples stand for more of them, sizes are those of all, each weighted by its
    relative noise.
    """

    name: str
    samples: Samples
    off: Array
    unconstrained: Array
    noise_std: float
    noise_unconstrained: float
    is_learned: bool

    @property
    def size(self) -> float:
        """The root mean square of `off`, in the unit of the samples."""
        return self._size(self.off)

    @property
    def size_unconstrained(self) -> float:
        """The same of the unconstrained fit."""
        return self._size(self.unconstrained)

    @property
    def in_noise(self) -> float:
        """The root mean square of `off`, in standard deviations of each sample's noise."""
        return self._weighted(self.off) / self.noise_std

    @property
    def is_large(self) -> bool:
        """Whether the reference ignores the samples.

        Three conditions have to hold; samples count by their relative noise. The reference is more than 3 times as far
        off as the unconstrained fit: so neither the kernel nor the noise explains it. It is off by more than the noise
        of that fit: one that passes through all samples is no measure. It is off by more than a tenth of their spread:
        less is hardly seen in a plot, however small the noise.
        """
        w = self.samples.relative_noise**-2
        about = self.samples.values - np.average(self.samples.values, weights=w)
        return self._weighted(self.off) > max(
            _TIMES_UNCONSTRAINED * self._weighted(self.unconstrained),
            _TIMES_NOISE * self.noise_unconstrained,
            _OF_SPREAD * self._weighted(about),
        )

    def _size(self, values: Array) -> float:
        return math.sqrt(self.samples.mean_square(values))

    def _weighted(self, values: Array) -> float:
        scatter = self.samples.scatter
        squares = float(np.sum((values / self.samples.relative_noise) ** 2)) + scatter.squares
        return float(np.sqrt(squares / (len(values) + scatter.count)))
