"""Signals that remember their values, as several quantities are evaluated at the same times."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.signal import KernelSum

_LONG = 32  # shorter rows of times are those of single minima, which no other quantity has


@dataclass(frozen=True)
class RememberedSum(KernelSum):
    """A sum of kernels that evaluates each long row of times once, `nearly`. Nothing is forgotten."""

    known: dict[bytes, Array] = field(default_factory=dict)

    @classmethod
    def of(cls, signal: KernelSum) -> Self:
        return cls(signal.kernel, signal.mean, signal.centres, signal.weights)

    def __call__(self, t: Array) -> Array:
        if np.ndim(t) != 2 or t.shape[-1] < _LONG:
            return self.nearly(t)
        keys = [row.tobytes() for row in t]
        new = [j for j, key in enumerate(keys) if key not in self.known]
        if new:
            self.known.update(zip((keys[j] for j in new), self.nearly(t[new]), strict=True))
        return np.stack([self.known[key] for key in keys])


@dataclass(frozen=True)
class Remembered:
    """What has these `signals`."""

    signals: tuple[RememberedSum, ...]

    @classmethod
    def of(cls, signals: Sequence[KernelSum]) -> Self:
        return cls(tuple(map(RememberedSum.of, signals)))
