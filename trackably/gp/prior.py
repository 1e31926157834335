"""The prior of one process: mean, kernel and noise, with hyperparameters that are known or learned."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from trackably.arguments import real
from trackably.arrays import Array
from trackably.gp.hyperparameter import (
    Hyperparameter,
    Learned,
    Scales,
    Search,
    as_learned,
    noise,
    with_next,
    with_value,
)
from trackably.gp.kernels.base import Kernel

NOISE = "noise_std"


@dataclass(frozen=True)
class Prior:
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
        """All hyperparameters by name, in natural units, known ones included; the noise is the last."""
        return {**self.kernel.hyperparameters, NOISE: self.noise_std}

    @cached_property
    def learned(self) -> tuple[str, ...]:
        """Names of the hyperparameters that are learned, in the order of every gradient."""
        return tuple(name for name, value in self.hyperparameters.items() if isinstance(value, Learned))

    @cached_property
    def places(self) -> npt.NDArray[np.intp]:
        """The indices of the learned hyperparameters among all, shape (p,)."""
        return np.flatnonzero([isinstance(value, Learned) for value in self.hyperparameters.values()])

    @cached_property
    def places_of_kernel(self) -> npt.NDArray[np.intp]:
        """The indices of the kernel's learned hyperparameters among all; the noise is not included."""
        return self.places[self.places < len(self.kernel.hyperparameters)]

    @property
    def log_hyperparameters(self) -> Array:
        """ln θ of the learned hyperparameters, shape (p,)."""
        return np.log([self.hyperparameters[name] for name in self.learned])

    def search(self, name: str, scales: Scales) -> Search:
        """Return the search interval of a hyperparameter: the given one, or one chosen from the
        `scales` of the samples.
        """
        value = self.hyperparameters[name]
        if isinstance(value, Learned) and value.interval:
            return Search(value.interval)
        return noise(scales) if name == NOISE else self.kernel.search(name, scales)

    def as_learned(self, names: Collection[str] | None = None) -> Self:
        """Return the prior with all hyperparameters learned, or only those in `names`; values do not change."""
        noise_std = as_learned(self.noise_std) if names is None or NOISE in names else self.noise_std
        return type(self)(self.kernel.as_learned(names), noise_std, self.mean)

    def as_known(self) -> Self:
        """Return the prior with every hyperparameter known at its current value."""
        return type(self)(self.kernel.as_known(), float(self.noise_std), self.mean)

    def with_hyperparameters(self, values: Mapping[str, float]) -> Self:
        """Return the prior with these values; learned hyperparameters stay learned."""
        own = {name: v for name, v in values.items() if name != NOISE}
        kernel = self.kernel.with_hyperparameters(own) if own else self.kernel
        return type(self)(kernel, with_value(self.noise_std, values.get(NOISE, self.noise_std)), self.mean)

    def with_learned(self, values: Sequence[float]) -> Self:
        """Return the prior with these values of the learned hyperparameters, in the order of every gradient.

        ValueError: the number of values is wrong, or one is not positive.
        """
        if len(values) != len(self.learned):
            raise ValueError(f"prior: expected {len(self.learned)} hyperparameters, got {len(values)}")
        for place, value in enumerate(values):
            if not 0 < value < math.inf:
                raise ValueError(f"prior: {self.learned[place]} must be a positive number, got {value!r}")
        following = iter(values)
        kernel, noise_std = self.kernel.moved(following), with_next(self.noise_std, following)
        moved = object.__new__(type(self))
        # Names do not depend on values: keep them, so that an optimiser does not compute them at every step.
        vars(moved).update(kernel=kernel, noise_std=noise_std, mean=self.mean)
        vars(moved).update(learned=self.learned, places=self.places, places_of_kernel=self.places_of_kernel)
        return moved

    def with_log_hyperparameters(self, log_theta: Array) -> Self:
        """Return the prior at ln θ of the learned hyperparameters, shape (p,): the inverse of `log_hyperparameters`."""
        return self.with_learned(np.exp(log_theta).tolist())
