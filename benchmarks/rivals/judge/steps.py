"""Sequences of states and inputs at sampling instants: nothing is said of the times between."""

from dataclasses import dataclass

import numpy as np

from benchmarks.rivals.model import Curve, Violation
from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem


@dataclass(frozen=True, eq=False)
class StepCurve(Curve):
    """`states` (K + 1, n) and `inputs` (K, m) of a plant at steps 0 … K; samples show the states `shown`."""

    plant: ConstrainedSystem
    states: Array
    inputs: Array
    shown: tuple[int, ...]

    def sampled(self, signal: int, t: Array) -> Array:
        """Between steps, a straight line: only to compare with samples."""
        steps = np.arange(len(self.states)) * self.plant.sampling_time
        return np.asarray(np.interp(t, steps, self.states[:, self.shown[signal]]))

    def violation(self, window: tuple[float, float]) -> Violation:
        """At the steps, whose stored values are all that there is."""
        found = Violation(0.0, 0.0, at_steps=True)
        for limit in self.plant.given_constraints:
            values = (self.states if limit.side == "state" else self.inputs) @ np.array(limit.row, dtype=float)
            outside = -limit.bounds.margin(values) / limit.bounds.width
            k = int(np.argmax(outside))
            if outside[k] > found.least:
                time = k * self.plant.sampling_time
                found = Violation(float(outside[k]), float(outside[k]), limit.name, time, at_steps=True)
        return found

    def violation_seen(self, window: tuple[float, float]) -> Violation:
        """There is nothing beside the steps."""
        return self.violation(window)
