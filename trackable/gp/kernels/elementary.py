"""Kernels that are given by numbers."""

import dataclasses
import math
from collections.abc import Mapping
from functools import cache
from typing import Self

import numpy as np

from trackable.arrays import Array
from trackable.gp.kernels.base import Kernel


class Elementary(Kernel):
    """A kernel whose dataclass fields are its hyperparameters, each positive and finite."""

    def __post_init__(self) -> None:
        for name, value in self.hyperparameters.items():
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{type(self).__name__}: {name} must be a positive finite number, got {value!r}")

    @property
    def hyperparameters(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in _field_names(type(self))}

    def with_hyperparameters(self, values: Mapping[str, float]) -> Self:
        return type(self)(**{**self.hyperparameters, **values})


@cache
def _field_names(kernel: type[Elementary]) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(kernel))


def stretched(jet: Array, r: Array) -> Array:
    """∂/∂ln ℓ of every κ⁽ⁿ⁾ when κ depends on time through r/ℓ only, from a jet that is one order longer.

    A longer ℓ is a slower clock: ∂κ/∂ln ℓ = −r κ̇, and n time derivatives later −(n κ⁽ⁿ⁾ + r κ⁽ⁿ⁺¹⁾).
    """
    gradient = r * jet[1:]
    for n in range(1, len(gradient)):
        gradient[n] += n * jet[n]
    return np.asarray(-gradient)
