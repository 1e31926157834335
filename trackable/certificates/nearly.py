"""Whether an envelope keeps every bound, approximately in float64: it guides a search, and proves nothing."""

from collections.abc import Callable, Mapping

import numpy as np

from trackable.gp.kernels.radial import Radial
from trackable.gp.signal import KernelSum
from trackable.systems.reference import Reference


def nearly_settled(reference: Reference, reserve: Mapping[str, float]) -> Callable[[float], bool] | None:
    """Return whether `settled_margins` from a start [s] on are positive, up to rounding; None where it is not known.

    It is known of linear combinations of signals whose kernels fall with the distance.
    """
    functionals = [quantity.trajectory.functional for quantity in reference.quantities]
    signals, plant = reference.kernel_sums, reference.plant
    if plant.flat_form is not None or not all(functionals) or not all(isinstance(s.kernel, Radial) for s in signals):
        return None
    means = [signal.mean for signal in signals]
    rows = [
        (
            [[float(w) for w in weights] for weights in functional.weights],
            min(functional.at_rest(means) - quantity.bounds.lower, quantity.bounds.upper - functional.at_rest(means))
            - reserve[quantity.name],
        )
        for quantity, functional in zip(reference.quantities, functionals, strict=True)
        if functional is not None
    ]

    def holds(start: float) -> bool:
        envelopes = [_envelope(signal, start) for signal in signals]
        return all(
            sum(_reach(np.array(w), *e, plant.sampling_time) for w, e in zip(weights, envelopes, strict=True)) <= room
            for weights, room in rows
        )

    return holds


def _reach(weights: np.ndarray, size: float, slope: float, step: float) -> float:
    each = np.abs(weights)
    shifted = step * float(np.arange(len(each)) @ each) * slope
    return min(float(np.sum(each)) * size, abs(float(np.sum(weights))) * size + shifted)


def _envelope(signal: KernelSum, start: float) -> tuple[float, float]:
    """Return Σ_i |c_i| K_i and Σ_i |c_i| D_i of `limits`."""
    distances, sizes = np.maximum(start - signal.centres, 0.0), np.abs(signal.weights)
    steepest = np.maximum(distances, signal.kernel.decay_distance)
    return float(sizes @ signal.kernel.jet(distances, 0)[0]), float(sizes @ np.abs(signal.kernel.jet(steepest, 1)[1]))
