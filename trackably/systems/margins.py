"""Margins of a reference on a fine grid of times: evidence, not a proof."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantity


@dataclass(frozen=True)
class MarginProfile:
    """Distance of a quantity to its nearer bound, negative outside, over K sampling intervals.

    In interval k, [k T_s, (k + 1) T_s), the smallest margin found is `margins[k]`, at `times[k]` [s]. `at_steps[k]` is
    the margin at k T_s, where trackability requires it to be non-negative. All have shape (K,).
    """

    quantity: Quantity
    times: Array
    margins: Array
    at_steps: Array

    @property
    def worst(self) -> tuple[float, float]:
        """The smallest margin found, and its time [s]."""
        k = int(np.argmin(self.margins))
        return float(self.margins[k]), float(self.times[k])

    @property
    def violated_steps(self) -> list[int]:
        """The steps k at which the bounds are violated at k T_s."""
        return [int(k) for k in np.flatnonzero(self.at_steps < 0)]


def margin_profile(reference: Reference, quantity: Quantity, last_step: int, instants_per_step: int) -> MarginProfile:
    """Compute margins at `instants_per_step` times in each of the sampling intervals 0 … last_step."""
    steps = np.arange(last_step + 1, dtype=float)[:, None]
    times = reference.instants(steps + np.arange(instants_per_step) / instants_per_step)
    margins = quantity.margin(reference.signals, times)
    smallest = np.argmin(margins, axis=1, keepdims=True)
    return MarginProfile(
        quantity,
        np.take_along_axis(times, smallest, axis=1)[:, 0],
        np.take_along_axis(margins, smallest, axis=1)[:, 0],
        margins[:, 0],
    )
