"""Evaluate several quantities of the same signals together: one sum of kernels for all of them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.gp.factors.cached import cached
from trackably.systems.flat.functional import Functional, Signals
from trackably.systems.quantity import Quantity

Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Quantities:
    """Bounded `quantities` along the same `signals`."""

    quantities: tuple[Quantity, ...]
    signals: Signals

    def __len__(self) -> int:
        return len(self.quantities)

    def values(self, t: Array) -> Array:
        """Return all quantities at t [s]: shape (Q, *t.shape)."""
        if not self.is_linear:
            return np.stack([quantity(self.signals, t) for quantity in self.quantities])
        found = np.repeat(self._offsets, t.size).reshape(len(self), t.size)
        for weights, shifted in self._shifted(t):
            found += weights @ shifted.reshape(len(shifted), t.size)
        return found.reshape(len(self), *t.shape)

    def values_of(self, which: Indices, t: Array) -> Array:
        """Return quantity `which[i]` at t[..., i] [s], for indices (m,) and times (..., m): the shape of t."""
        if not self.is_linear:
            found = np.empty(t.shape)
            for q in np.unique(which).tolist():
                found[..., which == q] = self.quantities[q](self.signals, t[..., which == q])
            return found
        found = np.empty(t.shape)
        found[...] = self._offsets[which]
        for weights, shifted in self._shifted(t):
            found += np.einsum("mj,j...m->...m", weights[which], shifted)
        return found

    def margins(self, t: Array) -> Array:
        """Return the margins of all quantities at t [s], as `Quantity.margin` does: shape (Q, *t.shape)."""
        every = np.arange(len(self)).reshape(-1, *(1,) * t.ndim)
        return self._margins(every, self.values(t))

    def margins_of(self, which: Indices, t: Array) -> Array:
        """Return the margin of quantity `which[i]` at t[..., i] [s]: the shape of t."""
        return self._margins(which, self.values_of(which, t))

    def _margins(self, which: Indices, values: Array) -> Array:
        lower, upper = self.bounds
        margins = np.minimum(values - lower[which], upper[which] - values)
        return np.where(np.isnan(margins), -np.inf, margins)

    @cached
    def bounds(self) -> tuple[Array, Array]:
        """The lower and the upper bounds: shape (Q,)."""
        bounds = [quantity.bounds for quantity in self.quantities]
        return np.array([each.lower for each in bounds]), np.array([each.upper for each in bounds])

    @property
    def is_linear(self) -> bool:
        """Whether all quantities are functionals."""
        return self._functionals is not None

    @cached
    def _functionals(self) -> list[Functional] | None:
        """The quantities where all of them are functionals."""
        found = [quantity.functional for quantity in self.quantities if quantity.functional is not None]
        return found if len(found) == len(self) else None

    @cached
    def _offsets(self) -> Array:
        return np.array([float(functional.offset) for functional in self._functionals or ()])

    @cached
    def _weights(self) -> list[tuple[int, Indices, Array]]:
        """For each signal c that matters, c, the shifts j that matter, and the weights w_qj: shape (Q, shifts)."""
        functionals, found = self._functionals or (), []
        for c in range(len(self.signals)):
            longest = max((len(functional.weights[c]) for functional in functionals), default=0)
            weights = np.zeros((len(self), longest))
            for row, functional in zip(weights, functionals, strict=True):
                row[: len(functional.weights[c])] = dict(functional.rounded).get(c, 0.0)
            (shifts,) = np.nonzero(np.any(weights, axis=0))
            if len(shifts):
                found.append((c, shifts, weights[:, shifts]))
        return found

    def _shifted(self, t: Array) -> Iterator[tuple[Array, Array]]:
        """Yield the weights (Q, J) of each signal, and the signal at t + j T_s: shape (J, *t.shape)."""
        for c, shifts, weights in self._weights:
            step = self.quantities[0].trajectory.sampling_time
            yield weights, self.signals[c](t + (shifts * step).reshape(-1, *(1,) * t.ndim))
