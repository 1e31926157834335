"""Learned hyperparameters that lie at an end of the interval in which they were sought."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.learning.space import SearchSpace
from trackably.systems.sets.interval import Interval

_AT_EDGE = 1e-4  # of ln θ: an optimiser stops there where its bound holds it back


@dataclass(frozen=True)
class Edge:
    """A learned hyperparameter that lies at an end of its search `interval`; `is_given` if the user chose it."""

    name: str
    value: float
    interval: Interval
    is_given: bool

    @classmethod
    def of(cls, name: str, value: float, interval: Interval) -> Self | None:
        """Return the edge at which a value lies; None where it lies inside."""
        inside = np.log([value / interval.lower, interval.upper / value]) > _AT_EDGE
        given = isinstance(value, Learned) and value.interval is not None
        return None if inside.all() else cls(name, float(value), interval, given)

    def __str__(self) -> str:
        end = "lower" if self.value < math.sqrt(self.interval.lower) * math.sqrt(self.interval.upper) else "upper"
        return f"{self.name} = {self.value:.4g} lies at the {end} end of the interval in which it was sought"


def edges_of(prior: JointPrior, samples: tuple[Samples, ...]) -> tuple[Edge, ...]:
    """Return the hyperparameters, learned from these samples, that lie at an end of their search interval."""
    space, learned = SearchSpace.around(samples, prior), prior.hyperparameters
    found = (Edge.of(name, learned[name], interval) for name, interval in space.bounds.items())
    return tuple(edge for edge in found if edge)
