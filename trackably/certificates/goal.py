"""The goal of certified learning: the times at which bounds are constrained, and the claim that is proved."""

from dataclasses import dataclass, replace
from math import inf
from typing import Self

from trackably.certificates.claim import refusal
from trackably.checker.certificate import AllPhases, AllTimes, Claim, Window
from trackably.gp.joint import JointPrior, common_period, has_period
from trackably.gp.samples import Samples, recorded_span
from trackably.systems.constrained import ConstrainedSystem

# A window is extended to _LONGER times the distance from its other end to the failure. It is not extended if the
# failure is _FAR lengths of the window after its start, or later.
_LONGER, _FAR = 1.5, 1e3


@dataclass(frozen=True)
class Goal:
    """What a certified learner has to reach: a proof of the `claim`, with bounds that are imposed at `times`.

    If the claim is about all t ≥ 0, and the proof fails at one of the other times, `times` is extended.
    """

    times: AllPhases | Window
    claim: Claim

    def reaching(self, time: float) -> Self | None:
        """Return the goal with constrained times that reach beyond `time` [s]; None if this time is too far away.

        It is the same goal if `time` is constrained already, or if the claim is about other times than all.
        """
        start, end = self.times.span
        if not isinstance(self.claim, AllTimes) or start <= time <= end:
            return self
        if not time - start < _FAR * (end - start):
            return None
        if time < start:
            start = max(end - _LONGER * (end - time), 0.0)
        else:
            end = start + _LONGER * (time - start)
        return replace(self, times=Window(start, end))


def goal_for(claim: Claim, samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    """Return the goal for a claim. Raises ValueError if the claim cannot be proved with the prior's kernels."""
    if isinstance(claim, Window):
        return Goal(claim, claim)
    if reason := refusal(claim, prior) or _refusal_of_bounds(claim, prior, plant):
        raise ValueError(f"claim: {reason}")
    return for_all_times(samples, prior, plant)


def _refusal_of_bounds(claim: Claim, prior: JointPrior, plant: ConstrainedSystem) -> str | None:
    """Return why this claim cannot be proved with the plant's bounds, some of which move in time; None if it can."""
    periods = frozenset[float | None]().union(*(quantity.bounds.periods for quantity in plant.quantities))
    if isinstance(claim, AllTimes) and periods - {None}:
        return "all_times needs bounds that end constant, but some have a period; all_phases is the claim for these"
    is_known = not any(name.endswith("period") for name in prior.learned)
    period = common_period([part.kernel for part in prior.parts]) if is_known else inf
    if isinstance(claim, AllPhases) and periods - {period}:
        return (
            "all_phases needs bounds that are constant, or have exactly the kernel's period, which must be known then, "
            "as in Periodic(period=2.0)"
        )
    return None


def for_all_times(samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    """Return the goal for every real t ≥ 0, by the claim that suits the kernels.

    If all kernels have one period, all phases are constrained. Otherwise a window around the samples is constrained, as
    long before and after them as they last, and a decaying envelope proves later times. The window is extended if the
    proof fails at other times.
    """
    if has_period(prior):
        return Goal(AllPhases(), AllPhases())
    first, last = recorded_span(samples)
    window = Window(max(2 * first - last, 0.0), 2 * last - first + plant.sampling_time)
    return Goal(window, AllTimes())
