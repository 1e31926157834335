"""States and inputs at several steps as one normal distribution, given samples."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.gp.bounded import root
from trackably.gp.joint import JointPosterior
from trackably.gp.row_posterior import RowPosterior
from trackably.gp.rows import Rows, Terms
from trackably.systems.flat.functional import Functional
from trackably.systems.flat.trajectory import Coordinate
from trackably.systems.reference import Reference


@dataclass(frozen=True, eq=False)
class StepNormal:
    """The p = n + m states and inputs of a plant at `steps` (S,), as a normal distribution.

    They are weighted sums of the learned signals at shifted times. For a nonlinear plant they are so to first order in
    the distance from the `reference`. The mean is that of the `posterior`, which may differ from the reference.
    """

    reference: Reference
    posterior: JointPosterior
    steps: Array

    @cached_property
    def mean(self) -> Array:
        """Shape (p, S)."""
        off = self.rows.values(self.posterior.signals) - self.rows.values(self.reference.signals)
        at_reference = np.array([q(self.reference.signals, self._times) for q in self._coordinates])
        return np.asarray(at_reference + off.reshape(at_reference.shape))

    @cached_property
    def root(self) -> Array:
        """F with which mean + F w has the right covariance for w ~ N(0, I_r): shape (p, S, r).

        Raises IllConditioned as the posterior does.
        """
        found = root(RowPosterior(self.posterior, self.rows).covariance)
        return found.reshape(len(self._coordinates), len(self.steps), -1)

    @cached_property
    def rows(self) -> Rows:
        """What a small change of the signals adds to each state and input: p S rows, step by step for each of them.

        Weights are NaN or infinite where an input has no derivative.
        """
        terms: list[list[Terms]] = [[] for _ in self.posterior.parts]
        each = [(q, t) for q in self._coordinates for t in self._times]
        for row, (q, t) in enumerate(each):
            for c, w in self._derivative(q, t):
                times = t + self.reference.plant.sampling_time * np.arange(len(w))
                terms[c].append(Terms(times, w, np.full(len(w), row)))
        return Rows(np.zeros(len(each)), tuple(Terms.joined(parts) for parts in terms))

    def _derivative(self, q: Coordinate, t: Array) -> list[tuple[int, Array]]:
        """Return pairs of a signal c and its weights at t, t + T_s, …."""
        if isinstance(q, Functional):
            return q.rounded
        with np.errstate(invalid="ignore"):
            return q.weights_at(self.reference.signals, t)

    @property
    def _coordinates(self) -> tuple[Coordinate, ...]:
        flatness = self.reference.plant.flatness
        return (*flatness.states, *flatness.inputs)

    @property
    def _times(self) -> Array:
        return self.steps * self.reference.plant.sampling_time
