"""Margins of a reference on a fine grid of times: evidence, not a proof."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantity


@dataclass(frozen=True)
class MarginProfile:
    """Margins of a quantity, its distances to the nearer bound (negative outside), over K sampling intervals.

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

    def coarser(self, rows: int) -> tuple[Array, "MarginProfile"]:
        """Return when each of at most `rows` rows begins [s], and the profile with these rows.

        A row stands for several sampling intervals, and has the smallest of their margins.
        """
        together = -(-len(self.margins) // rows)
        first = np.arange(0, len(self.margins), together)
        smallest = [k + int(np.argmin(self.margins[k : k + together])) for k in first]
        at_steps = np.minimum.reduceat(self.at_steps, first)
        coarse = MarginProfile(self.quantity, self.times[smallest], self.margins[smallest], at_steps)
        return first.astype(float) * self.quantity.sampling_time, coarse


def margin_profiles(reference: Reference, last_step: int, instants_per_step: int) -> list[MarginProfile]:
    """Compute margins of each quantity at `instants_per_step` times in each of the sampling intervals 0 … last_step."""
    steps = np.arange(last_step + 1, dtype=float)[:, None]
    times, found = reference.instants(steps + np.arange(instants_per_step) / instants_per_step), []
    for quantity in reference.quantities:
        margins = quantity.margin(reference.signals, times)
        smallest = np.argmin(margins, axis=1, keepdims=True)
        at, least = (np.take_along_axis(values, smallest, axis=1)[:, 0] for values in (times, margins))
        found.append(MarginProfile(quantity, at, least, margins[:, 0]))
    return found
