"""Noisy samples of a signal."""

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array


@dataclass(frozen=True)
class Samples:
    """`values` y_i observed at strictly increasing `times` t_i [s], both of shape (n,).

    Raises ValueError, naming the first offending entry, where they are not finite, not increasing or not of one length.
    """

    times: Array
    values: Array

    def __post_init__(self) -> None:
        for name in ("times", "values"):
            array = np.array(getattr(self, name), dtype=float)
            if array.ndim != 1 or array.size == 0:
                raise ValueError(f"samples: {name} must be a non-empty one-dimensional array, got shape {array.shape}")
            if bad := np.flatnonzero(~np.isfinite(array)).tolist():
                raise ValueError(f"samples: {name}[{bad[0]}] must be finite, got {array[bad[0]]}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if self.times.shape != self.values.shape:
            raise ValueError(
                f"samples: as many times as values are needed, got {self.times.size} and {self.values.size}"
            )
        if bad := np.flatnonzero(np.diff(self.times) <= 0).tolist():
            i = bad[0]
            what = "repeats" if self.times[i + 1] == self.times[i] else "lies before"
            raise ValueError(
                f"samples: times must increase strictly, but times[{i + 1}] = {self.times[i + 1]:g} s {what} "
                f"times[{i}] = {self.times[i]:g} s"
            )

    def __len__(self) -> int:
        return self.times.size
