"""Kernels with a standard deviation θ₁ and a length scale θ₂: what all of them share."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from flint import arb

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.floats.choice import Number, from_point
from trackable.certificates.kernels.base import Decay, KernelBalls, Sensitivity

FORMULA = 40
"""Roundings, in u θ₁², of one elementary kernel at a difference that is already rounded; κ ≤ θ₁²."""


@dataclass(frozen=True)
class ElementaryBalls(KernelBalls):
    """κ(r) = θ₁² φ(r/θ₂, …) with its hyperparameters as exact numbers."""

    signal_std: float
    lengthscale: float

    @cached_property
    def variance(self) -> arb:
        """θ₁²."""
        with ball_arithmetic():
            return arb(self.signal_std) ** 2

    @cached_property
    def length(self) -> arb:
        """θ₂."""
        return arb(self.lengthscale)

    @cached_property
    def squared_length(self) -> arb:
        """θ₂²."""
        with ball_arithmetic():
            return self.length**2


class RadialBalls(ElementaryBalls):
    """A kernel that falls with the distance; its |κ̇| rises up to `steepest` and falls from there on.

    With one branch, so does its bound on discs of one radius.
    """

    @property
    @abstractmethod
    def steepest(self) -> arb:
        """The distance ζ [s] of the largest |κ̇|."""

    def far(self, distance: Number, radius: Number) -> Number:
        return self.on_disc(distance, radius)

    def moment(self, reach: arb, size: arb) -> arb:
        """Bound |r κ| for |r| ≤ reach, where |κ| ≤ size."""
        return reach * size

    def beyond(self, distance: Number) -> Decay[Number]:
        steepest = self.taylor(from_point(distance.max(self.steepest), 2))
        # Where |κ̇| falls already, its series begins with the value.
        is_here = self.has_one_branch and np.all(distance >= self.steepest)
        return Decay(steepest[0] if is_here else self.value(distance), abs(steepest[1]))

    def sensitivity(self, reach: arb) -> Sensitivity:
        size, slope = self.largest
        # Of every radial kernel here |r κ̇| ≤ 2 θ₁².
        return Sensitivity(size, slope, 2 * size, self.moment(reach, size), self.roundings * size)

    @property
    def roundings(self) -> arb:
        """Roundings of the formula, in u θ₁²."""
        return arb(FORMULA)


def least_square(r: Number, radius: Number) -> Number:
    """Bound Re z² from below on |z − r| ≤ radius: with z = x + iy, Re z² = x² − y² ≥ r²/2 − radius²."""
    return r**2 / 2 - radius**2
