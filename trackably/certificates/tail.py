"""Propose a time after which the decay of the kernels keeps every bound for ever; the checker decides."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from trackably.arrays import Array
from trackably.certificates.draft import Draft
from trackably.gp.kernels.elementary import Radial
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference

_DOUBLINGS, _BISECTIONS = 100, 8


def tail_start(draft: Draft, reference: Reference, asks: bool = True) -> float | None:
    """Return a time [s] that the checker accepts, nearly the earliest one; None if there is none.

    If float64 finds the time, the checker is asked only once, and not at all if `asks` is False. Else its first pass is
    asked for each time, and its exact arithmetic only where that does not do.
    """
    moving = [float(end) for quantity in reference.quantities for end in quantity.bounds.breakpoints[-1:]]
    origin = max(0.0, *moving, *(max(signal.centres) for signal in draft.subject.signals))
    step = reference.plant.sampling_time
    guess = _envelopes(draft, reference)
    if guess and (found := _earliest(origin, step, guess)) is not None and (not asks or draft.is_settled(found)):
        return found
    return _earliest(origin, step, draft.seems_settled) or _earliest(origin, step, draft.is_settled)


def _earliest(origin: float, step: float, holds: Callable[[float], bool]) -> float | None:
    """Return the earliest time [s] found by doubling the distance from `origin`, then by bisection.

    None if there is none: the later the start, the smaller the envelope.
    """
    if not holds(origin + step * 2.0**_DOUBLINGS):
        return None
    high = next(r for d in range(_DOUBLINGS + 1) if holds(origin + (r := step * 2.0**d)))
    low = high / 2
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if holds(origin + middle) else (middle, high)
    return origin + high


def _envelopes(draft: Draft, reference: Reference) -> Callable[[float], bool] | None:
    """Return a function that tells whether envelopes from a start [s] keep all bounds, up to rounding.

    None if not known: it is for linear combinations of signals whose kernels decrease with distance.
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

    def holds(start: float) -> bool:
        envelopes = (_envelope(signal, start) for signal in signals)
        reach = sum(w.reach(*e, plant.sampling_time) for w, e in zip(weights, envelopes, strict=True))
        return bool(np.all(reach <= (1 - 1e-9) * room))

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

    def reach(self, size: float, slope: float, step: float) -> Array:
        """Return the bound of |Σ_j w_j (z(t + j T_s) − m)| for each quantity: shape (Q,)."""
        return np.minimum(self.each * size, np.abs(self.sum) * size + step * self.shifted * slope)


def _envelope(signal: KernelSum, start: float) -> tuple[float, float]:
    """Return Σ_i |c_i| sup |κ| and Σ_i |c_i| sup |κ̇| over all times after the start [s]."""
    distances, sizes = np.maximum(start - signal.centres, 0.0), np.abs(signal.weights)
    steepest = np.maximum(distances, signal.kernel.decay_distance)
    return float(signal.kernel.jet(distances, 0)[0] @ sizes), float(np.abs(signal.kernel.jet(steepest, 1)[1]) @ sizes)
