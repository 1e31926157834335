"""Failures of a proof: values, each with a sentence that explains it."""

import math
from dataclasses import dataclass

from trackably.systems.reference import Reference
from trackably.systems.sets.interval import Interval, rounded


@dataclass(frozen=True)
class Counterexample:
    """Bounds are certainly broken by at least `violation`, at `time` [s] or at exactly k T_s for a `step` k.

    The time is one of those that were to be proved of the `reference`: the real times in `span` [s], or, if there is a
    step, the instants in it.
    """

    quantity: str
    bounds: Interval
    time: float
    violation: float
    reference: Reference
    span: tuple[float, float]
    step: int | None = None

    @property
    def explanation(self) -> str:
        when = f"t = {self.time!r} s" if self.step is None else f"step {self.step} (t = {self.time:.6g} s)"
        by = rounded(self.violation, "down")
        return f"at {when} the {self.quantity} certainly breaks {self.bounds.exactly}, by at least {by}"

    def __repr__(self) -> str:
        return f"Counterexample({self.explanation})"


@dataclass(frozen=True)
class Unproved:
    """Neither a proof nor a counterexample was found: the margin is too small by `shortfall` (the quantity's unit).

    The proof of `quantity` fails in `box` [s]; `reason` says why.
    """

    quantity: str
    bounds: Interval
    box: tuple[float, float]
    shortfall: float
    reason: str

    @property
    def explanation(self) -> str:
        start, end = self.box
        if math.isinf(end - start) and math.isinf(self.shortfall):
            return f"it is not proved at any time that the {self.quantity} stays in {self.bounds}: {self.reason}"
        return (
            f"from t = {start:.9g} s to {end:.9g} s it is not proved that the {self.quantity} stays in {self.bounds}: "
            f"{self.reason} (short by {self.shortfall:.3g})"
        )

    def __repr__(self) -> str:
        return f"Unproved({self.explanation})"
