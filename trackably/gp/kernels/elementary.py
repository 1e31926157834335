"""Kernels whose dataclass fields are their hyperparameters."""

import dataclasses
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.hyperparameter import Hyperparameter, amplitude, as_text, duration
from trackably.gp.kernels.base import Kernel, lengthscale_gradient


class Elementary(Kernel):
    """A kernel whose dataclass fields are its hyperparameters, each a `Hyperparameter`."""

    @property
    def hyperparameters(self) -> dict[str, float]:
        values = vars(self)
        return {name: values[name] for name in _fields(type(self))}

    def __new__(cls, *given: object, **named: object) -> Self:
        """Refuse unknown hyperparameters. Python's own message would name the base class that has the fields."""
        known = _fields(cls)
        if named and (unknown := next((name for name in named if name not in known), None)):
            raise TypeError(f"{cls.__name__} has no hyperparameter {unknown!r}; it has {', '.join(known)}")
        if len(given) > len(known):
            raise TypeError(f"{cls.__name__} takes {', '.join(known)}, got {len(given)} values")
        return super().__new__(cls)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={as_text(v)}' for name, v in self.hyperparameters.items())})"

    def map_values(self, change: Callable[[str, float], float]) -> Self:
        return type(self)(*[change(name, value) for name, value in self.hyperparameters.items()])


@cache
def _fields(kernel: type[Elementary]) -> list[str]:
    return [field.name for field in dataclasses.fields(kernel)]


# Kernels κ(r) = θ₁² φ(r/θ₂) that decay with distance. Each class only states φ and its derivatives.


@dataclass(frozen=True, repr=False)
class Radial(Elementary):
    """κ(r) = θ₁² φ(r/θ₂) with `signal_std` θ₁ (the unit of the signal) and `lengthscale` θ₂ [s]."""

    signal_std: Hyperparameter = Hyperparameter(amplitude)
    lengthscale: Hyperparameter = Hyperparameter(duration)

    @abstractmethod
    def correlation(self, s: Array, order: int) -> Array:
        """Return φ and its derivatives up to `order` at s = r/θ₂; the shape is (order + 1, *s.shape)."""

    def jet(self, r: Array, order: int) -> Array:
        return self._in_time(self.correlation(r / float(self.lengthscale), order))

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        jet = self.jet(r, order + 1)
        gradient = np.empty((2, *jet[:-1].shape))
        gradient[0] = 2 * jet[:-1]
        gradient[1] = lengthscale_gradient(jet, r)
        return jet[:-1], gradient

    def _in_time(self, correlation: Array) -> Array:
        variance, lengthscale = float(self.signal_std) ** 2, float(self.lengthscale)
        for n in range(len(correlation)):
            correlation[n] *= variance / lengthscale**n
        return correlation
