"""What is believed before any sample, and which part of it is learned."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np

from trackable.arrays import Array
from trackable.gp.kernels.base import Kernel

NOISE = "noise_std"


@dataclass(frozen=True)
class Prior:
    """A constant `mean` m, a `kernel` κ, and the standard deviation `noise_std` σ_n of independent noise on samples.

    Every hyperparameter of the kernel is learned, and the noise is not, unless `fixed` (a set of names) says otherwise.
    """

    kernel: Kernel
    noise_std: float
    mean: float = 0.0
    fixed: frozenset[str] = field(default=frozenset({NOISE}))

    def __post_init__(self) -> None:
        if not (math.isfinite(self.noise_std) and self.noise_std > 0):
            raise ValueError(f"prior: noise_std must be a positive finite number, got {self.noise_std!r}")
        if not math.isfinite(self.mean):
            raise ValueError(f"prior: mean must be finite, got {self.mean!r}")
        if unknown := self.fixed - {NOISE} - self.kernel.hyperparameters.keys():
            raise ValueError(
                f"prior: fixed names no hyperparameter {', '.join(sorted(unknown))}; "
                f"there are {', '.join(self.hyperparameters)}"
            )

    @property
    def hyperparameters(self) -> dict[str, float]:
        """All of them, fixed ones and the noise (last) included, in natural units."""
        return {**self.kernel.hyperparameters, NOISE: self.noise_std}

    @cached_property
    def learned(self) -> tuple[str, ...]:
        """Names of the hyperparameters that are learned, in the order of every gradient."""
        return tuple(name for name in self.hyperparameters if name not in self.fixed)

    @cached_property
    def places(self) -> list[int]:
        """Where they stand among all."""
        return [i for i, name in enumerate(self.hyperparameters) if name not in self.fixed]

    @property
    def log_hyperparameters(self) -> Array:
        """ln θ of the learned ones, shape (p,)."""
        return np.log([self.hyperparameters[name] for name in self.learned])

    def with_hyperparameters(self, values: dict[str, float]) -> Self:
        kernel = self.kernel.with_hyperparameters({name: v for name, v in values.items() if name != NOISE})
        moved = type(self)(kernel, values.get(NOISE, self.noise_std), self.mean, self.fixed)
        # Names do not depend on the values; an optimiser would ask again at every step.
        vars(moved).update(learned=self.learned, places=self.places)
        return moved

    def with_log_hyperparameters(self, log_theta: Array) -> Self:
        """The inverse of `log_hyperparameters`."""
        return self.with_hyperparameters(dict(zip(self.learned, np.exp(log_theta).tolist(), strict=True)))
