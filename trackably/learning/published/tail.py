"""Bounds of a learned signal for all times after some instant, for kernels that decay (paper, Assumptions 2 to 4)."""

from dataclasses import dataclass

import numpy as np

from trackably.gp.signal import KernelSum
from trackably.learning.published.scalar import coefficients, equilibrium_input, interval_sets
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.sets.interval import Interval


@dataclass(frozen=True)
class Tail:
    """Bounds of a learned signal for all t ≥ `start` [s], where every sample is more than ζ before `start`.

    `mean_bound` m̄ ≥ |m⁺(t) − m| and `derivative_bound` (unit per second) ≥ |ṁ⁺(t)|: over-estimates, by the triangle
    inequality and monotone decay.
    """

    start: float
    mean: float
    mean_bound: float
    derivative_bound: float

    @property
    def states(self) -> Interval:
        """The interval that contains the signal, around the *prior* mean (line 7 of the paper: the posterior's)."""
        return Interval(self.mean - self.mean_bound, self.mean + self.mean_bound)

    def keeps_states(self, plant: ConstrainedSystem) -> bool:
        """Test line 7: every later state lies in X."""
        state_set, _ = interval_sets(plant)
        return state_set.contains(self.states)

    def keeps_rates(self, rates: tuple[float, float]) -> bool:
        """Test line 9 (both signs): every later step lies in [τ_low, τ_high] T_s, which is inside the tube."""
        low, high = rates
        return low <= -self.derivative_bound and self.derivative_bound <= high

    def inputs(self, plant: ConstrainedSystem) -> Interval:
        """Return an interval that contains u_r(t) for all later t (an over-estimate).

        With e = m⁺ − m, u_r(t) = u_m + ((1 − a) e(t) + (e(t + T_s) − e(t)))/b, where u_m holds the prior mean.
        """
        a, b, _ = coefficients(plant)
        centre = equilibrium_input(plant, self.mean)
        reach = (abs(1 - a) * self.mean_bound + self.derivative_bound * plant.sampling_time) / abs(b)
        return Interval(centre - reach, centre + reach)


def tail(signal: KernelSum, start: float) -> Tail | None:
    """Return the bounds from `start` [s] on; None if a sample is within ζ of it: the bounds need monotone decay."""
    if not start - np.max(signal.centres) > signal.kernel.decay_distance:
        return None
    kappa, rate = np.abs(signal.kernel.jet(start - signal.centres, 1)) @ np.abs(signal.weights)
    return Tail(start, signal.mean, float(kappa), float(rate))
