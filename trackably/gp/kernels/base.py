"""Stationary kernels, their sums and their products.

A kernel states its derivatives in time, and how they move with the hyperparameters. Everything else (Gram matrices,
posterior means, their time derivatives, likelihood gradients, constraint Jacobians) is written once, in terms of `jet`
and `jet_and_gradient`.
"""

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cached_property
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.hyperparameter import Scales, Search, learned, with_value
from trackably.gp.kernels.jets import leibniz
from trackably.gp.kernels.moments import Decay
from trackably.gp.kernels.spectral import SpectralDensity


@dataclasses.dataclass(frozen=True)
class Kernel(ABC):
    """Stationary covariance κ(r) of two instants that lie r = t − t' [s] apart. Kernels add and multiply."""

    @property
    @abstractmethod
    def hyperparameters(self) -> dict[str, float]:
        """Names and values, in natural units, in the order of every gradient."""

    @abstractmethod
    def changed(self, change: Callable[[str, float], float]) -> Self:
        """Return the same kernel with `change(name, value)` for the value of each hyperparameter."""

    @abstractmethod
    def moved(self, values: Iterator[float]) -> Self:
        """Return the same kernel with the next of the positive values, unchecked, for each learned hyperparameter."""

    @abstractmethod
    def search(self, name: str, scales: Scales) -> Search:
        """Return where a hyperparameter is sought if no interval is given for it."""

    def with_hyperparameters(self, values: Mapping[str, float]) -> Self:
        """Return the same kernel with other values of those that are named; learned ones stay learned.

        TypeError for unknown names.
        """
        if unknown := values.keys() - self.hyperparameters.keys():
            raise TypeError(f"{type(self).__name__} has no hyperparameter {', '.join(sorted(unknown))}")
        return self.changed(lambda name, value: with_value(value, values[name]) if name in values else value)

    def as_learned(self, names: Collection[str] | None = None) -> Self:
        """Return the same kernel with all hyperparameters learned, or those that are named, from where they are now."""
        return self.changed(lambda name, value: learned(value) if names is None or name in names else value)

    def as_known(self) -> Self:
        """Return the same kernel with every hyperparameter known, as it is now."""
        return self.changed(lambda _, value: float(value))

    @abstractmethod
    def jet(self, r: Array, order: int) -> Array:
        """Return κ(r) and its derivatives in r up to `order`: shape (order + 1, *r.shape), units [κ]/sⁿ."""

    @abstractmethod
    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        """Return the jet, and ∂/∂ln θ_j of the jet: shapes (order + 1, *r.shape) and (p, order + 1, *r.shape)."""

    def value_and_gradient(self, r: Array) -> tuple[Array, Array]:
        """Return κ(r), and ∂κ/∂ln θ_j: shapes (*r.shape) and (p, *r.shape)."""
        jet, gradient = self.jet_and_gradient(r, 0)
        return np.asarray(jet[0]), np.asarray(gradient[:, 0])

    @property
    @abstractmethod
    def decay_distance(self) -> float:
        """ζ(θ) [s] of the paper's Assumption 4: |κ̇(r)| strictly decreases for |r| > ζ; infinite where it never does.

        A finite ζ also promises Assumption 3: κ is positive and strictly decreases in |r|. With compact support this
        holds up to its end, and κ and κ̇ are zero from there on. Bounds of later times only need that nothing increases.
        """

    @property
    def period(self) -> float | None:
        """The period [s] that all parts of κ have, as the same float64; None where there is none."""
        return None

    @property
    def is_analytic(self) -> bool:
        """Whether κ has derivatives of every order, at 0 too: then few points resolve it, and all its derivatives."""
        return True

    @property
    def vanishing_distance(self) -> float:
        """A distance [s] beyond which κ and its derivatives are zero in float64; infinite where there is none."""
        return math.inf

    @property
    def negligible_distance(self) -> float:
        """A distance [s] beyond which κ and its derivatives are lost in rounding: less than 2⁻⁶⁰ of their largest."""
        return self.vanishing_distance

    @property
    def decays(self) -> tuple[Decay, ...]:
        """Polynomials times e^(−λ|r|) of which κ is the sum; none where it is no such sum."""
        return ()

    @property
    def spectral_density(self) -> SpectralDensity | None:
        """The spectral density of κ; None where it decays slowly, or is no function."""
        return None

    @cached_property
    def correlation_time(self) -> float:
        """√(κ(0)/|κ̈(0)|) [s]: how fast a signal of this kernel can turn."""
        jet = self.jet(np.zeros(()), 2)
        return float(np.sqrt(jet[0] / np.abs(jet[2])))

    def value(self, r: Array) -> Array:
        """Return κ(r), a few roundings beside `jet` where that is faster: for searches, not for what is proved."""
        return np.asarray(self.jet(r, 0)[0])

    def __call__(self, r: Array) -> Array:
        """Return κ(r): the shape of r."""
        return np.asarray(self.jet(np.asarray(r, dtype=float), 0)[0])

    def __add__(self, other: "Kernel") -> "Sum":
        return Sum(self, other)

    def __mul__(self, other: "Kernel") -> "Product":
        return Product(self, other)


@dataclasses.dataclass(frozen=True)
class _Pair(Kernel):
    """Two kernels; their hyperparameters are named left.… and right.…. TypeError for what is no kernel."""

    left: Kernel
    right: Kernel

    def __post_init__(self) -> None:
        for side, part in vars(self).items():
            if not isinstance(part, Kernel):
                raise TypeError(f"{type(self).__name__}: {side} must be a kernel, got {part!r}")

    @property
    def hyperparameters(self) -> dict[str, float]:
        parts = {"left": self.left, "right": self.right}
        return {f"{side}.{name}": v for side, part in parts.items() for name, v in part.hyperparameters.items()}

    def changed(self, change: Callable[[str, float], float]) -> Self:
        left = self.left.changed(lambda name, value: change(f"left.{name}", value))
        return type(self)(left, self.right.changed(lambda name, value: change(f"right.{name}", value)))

    def moved(self, values: Iterator[float]) -> Self:
        return type(self)(self.left.moved(values), self.right.moved(values))

    def search(self, name: str, scales: Scales) -> Search:
        side, _, inner = name.partition(".")
        return (self.left if side == "left" else self.right).search(inner, scales)

    @property
    def decay_distance(self) -> float:
        return max(self.left.decay_distance, self.right.decay_distance)

    @property
    def period(self) -> float | None:
        """The period that both parts have; None where they differ, though a multiple of both would do."""
        return self.left.period if self.left.period == self.right.period else None

    @property
    def is_analytic(self) -> bool:
        return self.left.is_analytic and self.right.is_analytic

    @abstractmethod
    def jet(self, r: Array, order: int) -> Array: ...


@dataclasses.dataclass(frozen=True)
class Sum(_Pair):
    """κ = κ_left + κ_right.

    Beyond both ζ the two derivatives have one sign (both kernels fall) and each magnitude decreases; so does their sum.
    """

    @property
    def vanishing_distance(self) -> float:
        return max(self.left.vanishing_distance, self.right.vanishing_distance)

    @property
    def negligible_distance(self) -> float:
        return max(self.left.negligible_distance, self.right.negligible_distance)

    @property
    def decays(self) -> tuple[Decay, ...]:
        left, right = self.left.decays, self.right.decays
        return left + right if left and right else ()

    @property
    def spectral_density(self) -> SpectralDensity | None:
        left, right = self.left.spectral_density, self.right.spectral_density
        return left + right if left and right else None

    def jet(self, r: Array, order: int) -> Array:
        return np.asarray(self.left.jet(r, order) + self.right.jet(r, order))

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        left, left_gradient = self.left.jet_and_gradient(r, order)
        right, right_gradient = self.right.jet_and_gradient(r, order)
        return left + right, np.concatenate([left_gradient, right_gradient])

    def value_and_gradient(self, r: Array) -> tuple[Array, Array]:
        left, left_gradient = self.left.value_and_gradient(r)
        right, right_gradient = self.right.value_and_gradient(r)
        return np.asarray(left + right), np.concatenate([left_gradient, right_gradient])


@dataclasses.dataclass(frozen=True)
class Product(_Pair):
    """κ = κ_left κ_right.

    Beyond both ζ, |κ̇| = |κ̇_left| κ_right + κ_left |κ̇_right|: products of positive decreasing functions, decreasing
    themselves. The signal_std of both parts only matter multiplied with each other: give one of them as known.
    """

    @property
    def vanishing_distance(self) -> float:
        return min(self.left.vanishing_distance, self.right.vanishing_distance)

    @property
    def negligible_distance(self) -> float:
        return min(self.left.negligible_distance, self.right.negligible_distance)

    def jet(self, r: Array, order: int) -> Array:
        return np.asarray(leibniz(self.left.jet(r, order)[None], self.right.jet(r, order)[None])[0])

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        left, left_gradient = self.left.jet_and_gradient(r, order)
        right, right_gradient = self.right.jet_and_gradient(r, order)
        gradient = np.concatenate([leibniz(left_gradient, right[None]), leibniz(left[None], right_gradient)])
        return leibniz(left[None], right[None])[0], gradient

    def value_and_gradient(self, r: Array) -> tuple[Array, Array]:
        left, left_gradient = self.left.value_and_gradient(r)
        right, right_gradient = self.right.value_and_gradient(r)
        return np.asarray(left * right), np.concatenate([left_gradient * right, left * right_gradient])
