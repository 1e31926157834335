"""A bounded quantity of a reference: one side of trackability."""

from dataclasses import dataclass

from pipeline.arrays import Array
from pipeline.systems.functional import Functional, Signals
from pipeline.systems.interval import Interval


@dataclass(frozen=True)
class Quantity:
    """A `functional` of the learned signals that is wanted in `bounds`: a state, an input, or a combination of them."""

    name: str
    functional: Functional
    bounds: Interval

    def __call__(self, signals: Signals, t: Array) -> Array:
        return self.functional(signals, t)

    def margin(self, signals: Signals, t: Array) -> Array:
        """Distance to the nearer bound at t [s]: negative where broken."""
        return self.bounds.margin(self(signals, t))
