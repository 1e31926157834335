"""Failures of a proof: values, each with a sentence that explains it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from trackably.checker.certificate import Claim
from trackably.files import save_accepted
from trackably.learning.problem import NoSolution
from trackably.systems.intervals import Interval, array_text, rounded_text
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening


@dataclass(frozen=True)
class Counterexample:
    """Bounds are certainly violated by at least `violation`, at `time` [s], or at exactly k T_s for a `step` k.

    The `claim` is that the `reference` keeps its bounds at certain times, of which this is one.
    """

    quantity: str
    bounds: Interval
    time: float
    violation: float
    reference: Reference
    claim: Claim
    step: int | None = None

    @property
    def box(self) -> tuple[float, float]:
        """The interval [time, time] in seconds: the same property as that of an `Unproved`."""
        return self.time, self.time

    @property
    def shortfall(self) -> float:
        """The violation: the amount by which the margin is too small, as in an `Unproved`."""
        return self.violation

    @property
    def explanation(self) -> str:
        when = f"t = {self.time!r} s" if self.step is None else f"step {self.step} (t = {self.time:.6g} s)"
        by = rounded_text(self.violation, "down")
        return f"at {when} the {self.quantity} certainly breaks {self.bounds.exactly}, by at least {by}"

    def save_counterexample(self, path: Path | str) -> Path:
        """Write the counterexample as a file for `python -m trackably check FILE`; return the path.

        Raises OSError, and ValueError if the checker has not accepted it. All that the library returns are accepted.
        """
        return save_accepted("save_counterexample", self, path)

    def __repr__(self) -> str:
        return f"Counterexample({self.explanation})"


_ADVICE = {
    "may not be positive": "a lower bound above zero of the states on which it depends would keep "
    "it positive, and np.sqrt(x**2 + 1e-6) in place of np.abs(x) is smooth",
    "an angle that jumps at ±π": "a vehicle has a heading only while it moves: give its speed a lower bound above "
    "zero; a heading does not jump inside of bounds that are up to 6.1 rad wide, and without bounds it may turn freely",
}
"""What helps against failures, by the ends of their reasons."""


@dataclass(frozen=True)
class Unproved:
    """Neither a proof nor a counterexample was found: the margin is too small by `shortfall` (the quantity's unit).

    `shortfall` is 0 if it is not known. The proof of `quantity` fails at some time in `box` [s]; `reason` says why.
    """

    quantity: str
    bounds: Interval
    box: tuple[float, float]
    shortfall: float
    reason: str

    def __post_init__(self) -> None:
        for ending, advice in _ADVICE.items():
            if self.reason.endswith(ending):
                object.__setattr__(self, "reason", f"{self.reason}; {advice}")

    @property
    def explanation(self) -> str:
        start, end = self.box
        if math.isinf(end - start) and math.isinf(self.shortfall):
            return f"it is not proved at any time that the {self.quantity} stays in {self.bounds}: {self.reason}"
        return (
            f"from t = {start:.9g} s to {end:.9g} s it is not proved that the {self.quantity} stays in {self.bounds}: "
            f"{self.reason}{f' (short by {self.shortfall:.3g})' if 0 < self.shortfall < math.inf else ''}"
        )

    def __repr__(self) -> str:
        return f"Unproved({self.explanation})"


@dataclass(frozen=True, repr=False)
class OutOfReach(NoSolution):
    """No sequence of states and inputs satisfies the bounds and the given values.

    `given` names a value that contradicts earlier ones, or the bounds that a nonlinear system has to violate; `missing`
    is the least correction of `given` that would be needed, in its unit. If bounds alone contradict each other, `given`
    is empty, and `missing` is the least part of their widths by which all of them would have to be moved. `among` lists
    the bounds and values that contradict each other, with their times. `contradiction` is the content of the file in
    which the checker finds the proof.
    """

    given: str
    missing: float
    among: tuple[str, ...]
    contradiction: Mapping[str, Any] = field(compare=False)

    @property
    def _contradiction(self) -> str:
        because, missing = "; ".join(self.among), rounded_text(self.missing, "down")
        if self.given:
            return f"{self.given} is out of reach by at least {missing}, because of {because}"
        return (
            f"bounds contradict each other, and each of these would have to be moved by {missing} of its "
            f"width at least: {because}"
        )


@dataclass(frozen=True, repr=False)
class Impossible(OutOfReach):
    """The plant's own bounds and the given values contradict each other, so that no reference exists.

    This holds for any kernel, samples, feedback and margin.
    """

    @property
    def explanation(self) -> str:
        return f"no reference exists, whatever the kernel and the samples: {self._contradiction}"


@dataclass(frozen=True, repr=False)
class NoSignal(OutOfReach):
    """No true signal explains the samples of the state `given`: those in `among` contradict each other.

    The contradiction needs every one of these samples. To explain them, the noise bound would have to grow by at least
    `missing` (0 if no larger noise helps), or the bound of what is `limited`, the signal's "slope" or "second
    derivative", by at least `growth`.
    """

    limited: str
    growth: float

    @property
    def explanation(self) -> str:
        noise = f"noise that is larger by {rounded_text(self.missing, 'down')}, or a " if self.missing else "a "
        return (
            f"no true signal explains the samples of {self.given}: {'; '.join(self.among)} contradict each other. "
            f"It takes {noise}{self.limited} that is larger by {rounded_text(self.growth, 'down')} at least"
        )


@dataclass(frozen=True, repr=False)
class TooFar(NoSolution):
    """No reference was found within a `tolerance` of the true signal of `state`. That there is none is not claimed.

    `least` is the smallest tolerance for which a linear program finds a reference that the plant can follow. Two
    signals that both explain the samples are twice the `radius` apart, up to the rounding errors of a linear program.
    """

    state: str
    tolerance: float
    least: float
    radius: float

    @property
    def explanation(self) -> str:
        return (
            f"no reference was found within the tolerance {self.tolerance:g} of every true signal of {self.state}: a "
            f"linear program finds references for tolerances above {rounded_text(self.least, 'up')}; below about "
            f"{rounded_text(self.radius, 'down')} there is none, as two signals that explain the samples are twice as "
            "far apart, and between the two nothing is proved"
        )


@dataclass(frozen=True, repr=False)
class InfeasibleTightening(OutOfReach):
    """No reference keeps the bounds after this `tightening`, for any kernel and samples.

    The tightening depends on the feedback and the margin: with others there may be a reference.
    """

    tightening: Tightening

    @property
    def explanation(self) -> str:
        drawn, others, margin, Z = [], [], self.tightening.margin, self.tightening.invariant
        if Z:
            drawn.append(f"for disturbances under the feedback K = {array_text(Z.feedback)}")
            others.append("another feedback=")
        if margin:
            drawn.append(f"by the margin {margin:g} of each width")
            others.append("a smaller margin=")
        return (
            f"no reference keeps the bounds tightened {' and '.join(drawn)}, whatever the kernel and the samples; "
            f"{' or '.join(others)} may leave more room: {self._contradiction}"
        )


@dataclass(frozen=True, repr=False)
class NotExcluded(NoSolution):
    """It is not shown that no reference exists, as the checker did not accept the contradiction; `reason` says why."""

    reason: str

    @property
    def explanation(self) -> str:
        return f"it is not shown that no reference exists: {self.reason}"
