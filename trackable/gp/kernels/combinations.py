"""Sums and products of kernels. Both are kernels again, and both keep monotone decay where both parts have it."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from math import comb
from typing import Self

import numpy as np

from trackable.arrays import Array
from trackable.gp.kernels.base import Kernel


@dataclass(frozen=True)
class _Pair(Kernel):
    """Two kernels; their hyperparameters are named left.… and right.…."""

    left: Kernel
    right: Kernel

    @property
    def hyperparameters(self) -> dict[str, float]:
        parts = {"left": self.left, "right": self.right}
        return {f"{side}.{name}": v for side, part in parts.items() for name, v in part.hyperparameters.items()}

    def with_hyperparameters(self, values: dict[str, float]) -> Self:
        def of(side: str) -> dict[str, float]:
            return {name.removeprefix(side): v for name, v in values.items() if name.startswith(side)}

        left, right = of("left."), of("right.")
        if unknown := values.keys() - self.hyperparameters.keys():
            raise TypeError(f"{type(self).__name__} has no hyperparameter {', '.join(sorted(unknown))}")
        return replace(self, left=self.left.with_hyperparameters(left), right=self.right.with_hyperparameters(right))

    @property
    def decay_distance(self) -> float:
        return max(self.left.decay_distance, self.right.decay_distance)

    @property
    def is_analytic(self) -> bool:
        return self.left.is_analytic and self.right.is_analytic

    @abstractmethod
    def jet(self, r: Array, order: int) -> Array: ...


@dataclass(frozen=True)
class Sum(_Pair):
    """κ = κ_left + κ_right.

    Beyond both ζ the two derivatives have one sign (both kernels fall) and each magnitude decreases; so does their sum.
    """

    @property
    def vanishing_distance(self) -> float:
        return max(self.left.vanishing_distance, self.right.vanishing_distance)

    def jet(self, r: Array, order: int) -> Array:
        return np.asarray(self.left.jet(r, order) + self.right.jet(r, order))

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        left, left_gradient = self.left.jet_and_gradient(r, order)
        right, right_gradient = self.right.jet_and_gradient(r, order)
        return left + right, np.concatenate([left_gradient, right_gradient])


@dataclass(frozen=True)
class Product(_Pair):
    """κ = κ_left κ_right.

    Beyond both ζ, |κ̇| = |κ̇_left| κ_right + κ_left |κ̇_right|: products of positive decreasing functions, decreasing
    themselves. Two signal_std in one product say the same thing twice: fix one of them.
    """

    @property
    def vanishing_distance(self) -> float:
        return min(self.left.vanishing_distance, self.right.vanishing_distance)

    def jet(self, r: Array, order: int) -> Array:
        return _leibniz(self.left.jet(r, order), self.right.jet(r, order))

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        left, left_gradient = self.left.jet_and_gradient(r, order)
        right, right_gradient = self.right.jet_and_gradient(r, order)
        gradient = [_leibniz(row, right) for row in left_gradient] + [_leibniz(left, row) for row in right_gradient]
        return _leibniz(left, right), np.stack(gradient)


def _leibniz(f: Array, g: Array) -> Array:
    """The jet of f g from the jets of f and g: (f g)⁽ⁿ⁾ = Σ_j C(n, j) f⁽ʲ⁾ g⁽ⁿ⁻ʲ⁾."""
    return np.stack([np.asarray(sum(comb(n, j) * f[j] * g[n - j] for j in range(n + 1))) for n in range(len(f))])
