"""A reference: what everything downstream takes."""

from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.gp.signal import KernelSum
from pipeline.systems.quantity import Quantity
from pipeline.systems.scalar import ConstrainedSystem


@dataclass(frozen=True)
class Reference:
    """A learned signal as the reference x_r(k) = m⁺(k T_s) of a constrained system."""

    signal: KernelSum
    plant: ConstrainedSystem

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Everything that is bounded: trackable means that each stays in its bounds at t = k T_s for all k ≥ 0."""
        return (self.plant.state, self.plant.input)

    def state(self, t: Array) -> Array:
        """x_r at t [s]."""
        return self.plant.state(self.signal, t)

    def input(self, t: Array) -> Array:
        """u_r at t [s]: the one input that takes x_r(t) to x_r(t + T_s)."""
        return self.plant.input(self.signal, t)

    def instants(self, steps: Array) -> Array:
        """The times k T_s [s] of steps k."""
        return np.asarray(steps) * self.plant.sampling_time

    def tube(self, t: Array) -> tuple[Array, Array]:
        """Ends of the reachable tube at t + T_s: what the system can reach from x_r(t) in one step."""
        return self.plant.successor_set(self.state(t))
