"""The prior of one process: mean, kernel and noise, with hyperparameters that are known or learned."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property as cached
from typing import Self

import numpy as np
import numpy.typing as npt

from trackably.arguments import real
from trackably.gp.hyperparameter import Hyperparameter, Learned, Parametrized, noise
from trackably.gp.kernels.base import Kernel

NOISE = "noise_std"


@dataclass(frozen=True)
class Prior(Parametrized):
    """A constant `mean` m, a `kernel` κ, and the standard deviation `noise_std` σ_n of independent noise on samples.

    Each hyperparameter of the kernel, and σ_n, is known or learned (see `gp.hyperparameter`). ValueError: the mean is
    not finite. TypeError: it is no number.
    """

    kernel: Kernel
    noise_std: Hyperparameter = Hyperparameter(noise)
    mean: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", real("prior: mean", self.mean))

    @property
    def hyperparameters(self) -> dict[str, float]:
        """All hyperparameters by name (values, not logarithms), known ones included; the noise is the last."""
        return {**self.kernel.hyperparameters, NOISE: self.noise_std}

    @cached
    def places(self) -> npt.NDArray[np.intp]:
        """The indices of the learned hyperparameters among all, shape (p,)."""
        return np.flatnonzero([isinstance(value, Learned) for value in self.hyperparameters.values()])

    def map_values(self, change: Callable[[str, float], float]) -> Self:
        return type(self)(self.kernel.map_values(change), change(NOISE, self.noise_std), self.mean)
