"""Whether an envelope keeps every bound, approximately in float64: it guides a search, and proves nothing."""

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from trackable.arrays import Array
from trackable.certificates.floats.balls import Mask
from trackable.gp.kernels.radial import Radial
from trackable.gp.signal import KernelSum
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.reference import Reference


def nearly_settled(reference: Reference, reserve: Mapping[str, float]) -> Callable[[Array], Mask] | None:
    """Return whether `settled_margins` from starts [s] on are positive, up to rounding; None where it is not known.

    It is known of linear combinations of signals whose kernels fall with the distance.
    """
    signals, plant = reference.kernel_sums, reference.plant
    every = _weights(plant)
    if every is None or not all(isinstance(s.kernel, Radial) for s in signals):
        return None
    rows = []
    for (weights, offset), quantity in zip(every, reference.quantities, strict=True):
        rest = offset + sum(w.sum * signal.mean for w, signal in zip(weights, signals, strict=True))
        room = min(rest - quantity.bounds.lower, quantity.bounds.upper - rest)
        rows.append((weights, room - reserve[quantity.name]))

    def holds(starts: Array) -> Mask:
        envelopes, found = [_envelope(signal, starts) for signal in signals], np.ones(starts.shape, dtype=bool)
        for weights, room in rows:
            found &= sum(w.reach(*e, plant.sampling_time) for w, e in zip(weights, envelopes, strict=True)) <= room
        return found

    return holds


@lru_cache
def _weights(plant: ConstrainedSystem) -> list[tuple[list["_Weights"], float]] | None:
    """Return the weights and the offset of each quantity; None unless all of them are functionals."""
    functionals = [quantity.functional for quantity in plant.quantities]
    if plant.flat_form is not None:
        return None
    found = [([_Weights.of(w) for w in each.weights], float(each.offset)) for each in functionals if each]
    return found if len(found) == len(functionals) else None


class _Weights(NamedTuple):
    """Of the weights w_j of one signal Σ_j |w_j|, Σ_j w_j and Σ_j j |w_j|."""

    each: float
    sum: float
    shifted: float

    @classmethod
    def of(cls, weights: Sequence[Fraction]) -> Self:
        each = np.abs([float(w) for w in weights])
        return cls(float(np.sum(each)), float(sum(weights)), float(np.arange(len(each)) @ each))

    def reach(self, size: Array, slope: Array, step: float) -> Array:
        """Return the bound of |Σ_j w_j e(t + j T_s)| of `limits`."""
        return np.minimum(self.each * size, abs(self.sum) * size + step * self.shifted * slope)


def _envelope(signal: KernelSum, starts: Array) -> tuple[Array, Array]:
    """Return Σ_i |c_i| K_i and Σ_i |c_i| D_i of `limits`: the shape of the starts each."""
    distances, sizes = np.maximum(starts[:, None] - signal.centres, 0.0), np.abs(signal.weights)
    steepest = np.maximum(distances, signal.kernel.decay_distance)
    return signal.kernel.jet(distances, 0)[0] @ sizes, np.abs(signal.kernel.jet(steepest, 1)[1]) @ sizes
