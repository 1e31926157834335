"""Propose a time after which the decay of the kernels keeps every bound for ever; the checker decides."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from trackably.arrays import Array, Flags
from trackably.certificates.draft import Draft
from trackably.gp.kernels.elementary import Radial
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference

_DOUBLINGS, _BISECTIONS = 100, 8


def tail_start(draft: Draft, reference: Reference, asks: bool = True) -> float | None:
    """Return a time [s] that the checker accepts, nearly the earliest one; None if there is none.

    The later the start, the smaller the envelope: doubling finds such a time, and bisection an earlier one. If float64
    finds the time, the checker is asked only once, and not at all if `asks` is False.
    """
    moving = [float(end) for quantity in reference.quantities for end in quantity.bounds.breakpoints[-1:]]
    origin = max(0.0, *moving, *(max(signal.centres) for signal in draft.subject.signals))
    step = reference.plant.sampling_time
    guess = _envelopes(draft, reference)
    if guess and (found := _earliest(origin, step, guess)) is not None and (not asks or draft.is_settled(found)):
        return found
    return _earliest(origin, step, lambda starts: np.array([draft.is_settled(start) for start in starts.tolist()]))


def _earliest(origin: float, step: float, holds: Callable[[Array], Flags]) -> float | None:
    """Return the earliest time [s] found by doubling the distance from `origin`, then by bisection.

    None if there is none.
    """
    high = next((r for d in range(_DOUBLINGS) if holds(np.array([origin + (r := step * 2.0**d)]))[0]), None)
    if high is None:
        return None
    low = high / 2
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if holds(np.array([origin + middle]))[0] else (middle, high)
    return float(origin + high)


def _envelopes(draft: Draft, reference: Reference) -> Callable[[Array], Flags] | None:
    """Return a function that tells whether envelopes from starts [s] keep all bounds, up to rounding.

    None if not known.

    It is known for linear combinations of signals whose kernels decrease with distance.
    """
    signals, plant = reference.kernel_sums, reference.plant
    every = _weights(plant)
    if every is None or not all(isinstance(s.kernel, Radial) for s in signals):
        return None
    weights, offsets = every
    rest = offsets + sum(w.sum * signal.mean for w, signal in zip(weights, signals, strict=True))
    bounds = [quantity.bounds.rest for quantity in reference.quantities]
    room = np.minimum(rest - [each.lower for each in bounds], [each.upper for each in bounds] - rest)
    room -= [draft.errors[quantity.name] for quantity in reference.quantities]

    def holds(starts: Array) -> Flags:
        envelopes = (_envelope(signal, starts) for signal in signals)
        reach = sum(w.reach(*e, plant.sampling_time) for w, e in zip(weights, envelopes, strict=True))
        return np.asarray(np.all(reach <= (1 - 1e-9) * room, axis=-1))

    return holds


@lru_cache
def _weights(plant: ConstrainedSystem) -> tuple[list["_Weights"], Array] | None:
    """Return the weights of each signal, and the offsets of all quantities.

    None unless all of them are linear functionals.
    """
    functionals = [quantity.functional for quantity in plant.quantities if quantity.functional]
    if plant.flat_form is not None or len(functionals) < len(plant.quantities):
        return None
    of_signals = (_Weights.of([each.weights[c] for each in functionals]) for c in range(plant.signal_count))
    return list(of_signals), np.array([float(each.offset) for each in functionals])


class _Weights(NamedTuple):
    """Sums of the weights w_j of one signal in each quantity: Σ_j |w_j|, Σ_j w_j and Σ_j j |w_j|, shape (Q,) each."""

    each: Array
    sum: Array
    shifted: Array

    @classmethod
    def of(cls, rows: Sequence[Sequence[Fraction]]) -> Self:
        sizes = [[abs(float(w)) for w in row] for row in rows]
        shifted = [sum(j * size for j, size in enumerate(row)) for row in sizes]
        return cls(np.array(list(map(sum, sizes))), np.array([float(sum(row)) for row in rows]), np.array(shifted))

    def reach(self, size: Array, slope: Array, step: float) -> Array:
        """Return the bound of |Σ_j w_j (z(t + j T_s) − m)| for each quantity: shape (n, Q)."""
        size, slope = size[:, None], slope[:, None]
        return np.minimum(self.each * size, np.abs(self.sum) * size + step * self.shifted * slope)


def _envelope(signal: KernelSum, starts: Array) -> tuple[Array, Array]:
    """Return Σ_i |c_i| sup |κ| and Σ_i |c_i| sup |κ̇| over all times after each of the starts [s]."""
    distances, sizes = np.maximum(starts[:, None] - signal.centres, 0.0), np.abs(signal.weights)
    steepest = np.maximum(distances, signal.kernel.decay_distance)
    return signal.kernel.jet(distances, 0)[0] @ sizes, np.abs(signal.kernel.jet(steepest, 1)[1]) @ sizes
