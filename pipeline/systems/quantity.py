"""A bounded quantity of a reference: a weighted sum of the learned signal at shifted times."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.systems.interval import Interval


@dataclass(frozen=True)
class Quantity:
    """q(t) = offset + Σ_j w_j m⁺(t + j T_s), wanted in `bounds`.

    A reference's state and its own input have this form. Being linear in the signal, a quantity has the derivatives of
    the signal, in time and in the hyperparameters, combined with the same weights.
    """

    name: str
    weights: tuple[float, ...]
    offset: float
    bounds: Interval
    sampling_time: float

    def __call__(self, signal: Callable[[Array], Array], t: Array) -> Array:
        values = signal(self.instants(np.asarray(t, dtype=float)))
        return np.asarray(self.offset + sum(w * value for w, value in zip(self.weights, values, strict=True)))

    def at_rest(self, level: float) -> float:
        """The value of the quantity when the signal is constant."""
        return self.offset + sum(self.weights) * level

    def combine(self, linear: Callable[[Array], Array], t: Array) -> Array:
        """Σ_j w_j f(t + j T_s) for any f that is linear in the signal: a derivative, a gradient."""
        t = np.asarray(t, dtype=float)
        return np.asarray(sum(w * linear(t + j * self.sampling_time) for j, w in enumerate(self.weights)))

    def instants(self, t: Array) -> Array:
        """The times t + j T_s [s] at which q(t) looks at the signal: shape (len(weights), *t.shape)."""
        return np.stack([t + j * self.sampling_time for j in range(len(self.weights))])
