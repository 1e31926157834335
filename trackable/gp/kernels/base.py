"""What a stationary kernel is: its derivatives in time, and how they move with the hyperparameters.

Everything else (Gram matrices, posterior means, their time derivatives, likelihood gradients, constraint Jacobians) is
written once, in terms of the two methods below.
"""

import dataclasses
import math
from abc import ABC, abstractmethod
from functools import cache
from typing import Self

import numpy as np

from trackable.arrays import Array

UNDERFLOW = 746.0  # e^(−x) is zero in float64 for every x beyond


@dataclasses.dataclass(frozen=True)
class Kernel(ABC):
    """Stationary covariance κ(r) of two instants that lie r = t − t' [s] apart."""

    @property
    @abstractmethod
    def hyperparameters(self) -> dict[str, float]:
        """Names and values, in natural units, in the order of every gradient."""

    @abstractmethod
    def with_hyperparameters(self, values: dict[str, float]) -> Self:
        """The same kernel with other values; unnamed ones stay as they are."""

    @abstractmethod
    def jet(self, r: Array, order: int) -> Array:
        """κ(r) and its derivatives in r up to `order`: shape (order + 1, *r.shape), units [κ]/sⁿ."""

    @abstractmethod
    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        """The jet, and ∂/∂ln θ_j of the jet: shapes (order + 1, *r.shape) and (p, order + 1, *r.shape)."""

    def value_and_gradient(self, r: Array) -> tuple[Array, Array]:
        """κ(r), and ∂κ/∂ln θ_j: shapes (*r.shape) and (p, *r.shape)."""
        jet, gradient = self.jet_and_gradient(r, 0)
        return np.asarray(jet[0]), np.asarray(gradient[:, 0])

    @property
    @abstractmethod
    def decay_distance(self) -> float:
        """ζ(θ) [s] of the paper's Assumption 5: |κ̇(r)| strictly decreases for |r| > ζ; infinite where it never does.

        A finite ζ also promises Assumption 4: κ is positive and strictly decreases in |r|.
        """

    @property
    def is_analytic(self) -> bool:
        """Whether κ has derivatives of every order, at 0 too: then few points resolve it, and all its derivatives."""
        return True

    @property
    def vanishing_distance(self) -> float:
        """A distance [s] beyond which κ and its derivatives are zero in float64; infinite where there is none."""
        return math.inf

    @property
    def correlation_time(self) -> float:
        """√(κ(0)/|κ̈(0)|) [s]: how fast a signal of this kernel can turn."""
        jet = self.jet(np.zeros(()), 2)
        return float(np.sqrt(jet[0] / np.abs(jet[2])))

    def __call__(self, r: Array) -> Array:
        """κ(r): the shape of r."""
        return np.asarray(self.jet(np.asarray(r, dtype=float), 0)[0])


class Elementary(Kernel):
    """A kernel whose dataclass fields are its hyperparameters, each positive and finite."""

    def __post_init__(self) -> None:
        for name, value in self.hyperparameters.items():
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{type(self).__name__}: {name} must be a positive finite number, got {value!r}")

    @property
    def hyperparameters(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in _field_names(type(self))}

    def with_hyperparameters(self, values: dict[str, float]) -> Self:
        return type(self)(**(self.hyperparameters | values))


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
