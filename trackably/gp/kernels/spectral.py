"""Spectral densities S(ω) = ∫ κ(r) e^(−iωr) dr of kernels that decay fast, as their densities do."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array

_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class SpectralDensity:
    """`at(ω)` returns S and ∂ln S/∂ln θ_j at frequencies ω [rad/s] of shape (m,): shapes (m,) and (p, m).

    `largest` bounds |κ|. Beyond `reach` [s] κ, and beyond `limit` [rad/s] its density, are lost in rounding.
    """

    largest: float
    reach: float
    limit: float
    at: Callable[[Array], tuple[Array, Array]]

    def __add__(self, other: "SpectralDensity") -> "SpectralDensity":
        """Return the density of a sum of kernels."""

        def at(omega: Array) -> tuple[Array, Array]:
            (one, by_one), (two, by_two) = self.at(omega), other.at(omega)
            whole = one + two
            shares = np.array([one, two]) / np.maximum(whole, _TINY)
            return whole, np.concatenate([shares[0] * by_one, shares[1] * by_two])

        reach, limit = max(self.reach, other.reach), max(self.limit, other.limit)
        return SpectralDensity(self.largest + other.largest, reach, limit, at)

    def filtered(self, gain: Callable[[Array], Array], largest: float, length: float) -> "SpectralDensity":
        """Return the density behind a filter of this `length` [s], whose `gain` is |F(ω)|² of its transform F.

        No covariance becomes more than `largest` times as large.
        """

        def at(omega: Array) -> tuple[Array, Array]:
            density, gradient = self.at(omega)
            return density * gain(omega), gradient

        return SpectralDensity(largest * self.largest, self.reach + length, self.limit, at)
