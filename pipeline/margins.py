"""Margins of a reference on a fine grid of times: evidence, not a proof."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantity

_ROWS = 1001  # most rows of margins: a figure and a viewer show no more


@dataclass(frozen=True)
class MarginProfile:
    """Margins of a quantity: its distances to the nearer bound, negative outside, in K rows.

    A row stands for one sampling interval [k T_s, (k + 1) T_s) or several, and begins at `starts` [s]. The smallest
    margin found in it is one of `margins`, at one of `times` [s]. `at_steps` has the smallest margin at its steps,
    where trackability requires it to be non-negative. All have shape (K,).
    """

    quantity: Quantity
    starts: Array
    times: Array
    margins: Array
    at_steps: Array

    @property
    def worst(self) -> tuple[float, float]:
        """The smallest margin found, and its time [s]."""
        k = int(np.argmin(self.margins))
        return float(self.margins[k]), float(self.times[k])

    @property
    def violated(self) -> list[int]:
        """The rows in which the bounds are violated at a step."""
        return [int(k) for k in np.flatnonzero(self.at_steps < 0)]


def margin_profiles(reference: Reference, last_step: int, instants_per_step: int) -> list[MarginProfile]:
    """Compute margins of each quantity at `instants_per_step` times in each of the sampling intervals 0 … last_step."""
    steps = np.arange(last_step + 1, dtype=float)[:, None]
    times, found = reference.instants(steps + np.arange(instants_per_step) / instants_per_step), []
    together = -(-len(times) // _ROWS)
    first = np.arange(0, len(times), together)
    for quantity in reference.quantities:
        margins = quantity.margin(reference.signals, times)
        smallest = [k * instants_per_step + int(np.argmin(margins[k : k + together])) for k in first]
        at, least = times.ravel()[smallest], margins.ravel()[smallest]
        at_steps = np.minimum.reduceat(margins[:, 0], first)
        found.append(MarginProfile(quantity, first.astype(float) * quantity.sampling_time, at, least, at_steps))
    return found
