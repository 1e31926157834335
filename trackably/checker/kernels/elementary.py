"""Kernels with a standard deviation θ₁ and a length scale θ₂: hyperparameters as intervals, and what all share."""

from dataclasses import astuple, dataclass
from functools import cached_property

from trackably.checker.arithmetic.intervals import ONE, ZERO, Real, exactly, max_of
from trackably.checker.kernels.base import Decay, Kernel


@dataclass(frozen=True)
class Elementary(Kernel):
    """κ(r) = θ₁² φ(r/θ₂, …); every field of the dataclass is a positive number."""

    signal_std: float
    lengthscale: float

    @property
    def numbers(self) -> tuple[float, ...]:
        return astuple(self)

    @cached_property
    def variance(self) -> Real:
        """θ₁²."""
        return exactly(self.signal_std) ** 2

    @cached_property
    def length(self) -> Real:
        """θ₂."""
        return exactly(self.lengthscale)

    def scaled(self, shape: list[Real]) -> list[Real]:
        """Return the coefficients of θ₁² φ from those of φ."""
        variance = self.variance
        return [variance * coefficient for coefficient in shape]

    def falling(self, distance: Real, steepest: Real) -> Decay:
        """Return the bounds of a κ that falls with the distance, whose |κ̇| rises up to `steepest` and then falls."""
        value = self.taylor(distance, ZERO, 1)[0]
        slope = self.taylor(max_of(steepest, distance), ONE, 2)[1]
        return Decay(abs(value), abs(slope))
