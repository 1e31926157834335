"""The goal of certified learning: the times at which bounds are constrained, and the function that proves them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import inf, isfinite
from typing import Literal, Self

from trackably.arguments import is_number
from trackably.certificates.prove import Outcome, prove, prove_on_window, prove_while_settling
from trackably.gp.joint import JointPrior, common_period, has_period
from trackably.gp.samples import Samples
from trackably.learning.index_set import AllPhases, IndexSet, Window
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference

Claim = Literal["all_times", "all_phases"] | tuple[float, float]
"""All times of a kernel that decays, all phases of a periodic one, or the window from start to end [s]."""

_LONGER, _FAR = 1.5, 1e3


def checked_claim(claim: object) -> Claim:
    """Return the claim, with a window as two floats. ValueError: it is no claim."""
    match claim:
        case str("all_times") | str("all_phases"):
            return claim
        case (start, end) if is_number(start) and is_number(end) and isfinite(start) and isfinite(end):
            if not start < end:
                raise ValueError(f"claim: a window needs start < end, got [{start!r}, {end!r}]")
            return float(start), float(end)
    raise ValueError(f"claim: expected 'all_times', 'all_phases' or (start, end) in seconds, got {claim!r}")


def span_of(claim: Claim) -> tuple[float, float]:
    """Return the first and the last claimed time [s]; infinite if there is none."""
    return claim if isinstance(claim, tuple) else (0.0 if claim == "all_times" else -inf, inf)


@dataclass(frozen=True)
class Goal:
    """Bounds are constrained at `times` and proved by `prove`.

    If the goal `is_extensible`, the proof covers later times too, and `times` is extended if the proof fails there.
    """

    times: IndexSet
    prove: Callable[[Reference], Outcome]
    is_extensible: bool = False

    def extends_to(self, failed_at: float) -> bool:
        """Whether the window is extended if the proof fails at this time [s], after all constraints."""
        return self.is_extensible and isinstance(self.times, Window) and failed_at > self.times.end

    def longer(self, failed_at: float) -> Self | None:
        """Return the goal with constraints up to beyond `failed_at` [s]; None if that is too far away."""
        assert isinstance(self.times, Window), "only a window can be extended"
        if not failed_at < _FAR * self.times.end:
            return None
        return replace(self, times=Window(self.times.start, _LONGER * failed_at))


def goal_for(claim: Claim, samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    """Return the goal for a claim. Raises ValueError if the claim cannot be proved with the prior's kernels."""
    if isinstance(claim, tuple):
        return on_window(*claim)
    if reason := refusal(claim, prior) or _refusal_of_bounds(claim, prior, plant):
        raise ValueError(f"claim: {reason}")
    return for_all_times(samples, prior, plant)


def _refusal_of_bounds(claim: Claim, prior: JointPrior, plant: ConstrainedSystem) -> str | None:
    """Return the reason why this claim cannot be proved with bounds that move as these do; None if it can."""
    periods = frozenset[float | None]().union(*(quantity.bounds.periods for quantity in plant.quantities))
    if claim == "all_times" and periods - {None}:
        return "all_times needs bounds that rest in the end, but some have a period; all_phases is the claim for these"
    is_known = not any(name.endswith("period") for name in prior.learned)
    period = common_period([part.kernel for part in prior.parts]) if is_known else inf
    if claim == "all_phases" and periods - {period}:
        return (
            "all_phases needs bounds that are constant, or have exactly the kernel's period, which must be known then, "
            "as in Periodic(period=2.0)"
        )
    return None


def refusal(claim: Claim, prior: JointPrior) -> str | None:
    """Return the reason why this claim cannot be proved with the prior's kernels; None if it can."""
    kernels = ", ".join(type(part.kernel).__name__ for part in prior.parts)
    if claim == "all_phases" and not has_period(prior):
        return f"all_phases needs periodic kernels of one period, got {kernels}"
    if claim == "all_times" and has_period(prior):
        return f"all_times needs kernels that decay, got {kernels}; all_phases is the claim for periodic ones"
    return None


def for_all_times(samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    """Return the goal for every real t ≥ 0, by the claim that suits the kernels.

    If all kernels have one period, all phases are constrained. Otherwise a window from 0 on is constrained, and a
    decaying envelope proves later times. The window is extended if the proof fails at a later time.
    """
    if has_period(prior):
        return Goal(AllPhases(), prove)
    first, last = min(float(s.times[0]) for s in samples), max(float(s.times[-1]) for s in samples)
    return Goal(Window(0.0, 2 * last - first + plant.sampling_time), prove_while_settling, is_extensible=True)


def for_all_times_again(samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    """Return the goal of `for_all_times` for a reference that is likely to be proved, as a
    similar one was: see `prove`.
    """
    return replace(for_all_times(samples, prior, plant), prove=partial(prove, is_likely=True))


def on_window(start: float, end: float) -> Goal:
    """Return the goal for every real t from `start` to `end` [s]. ValueError: these are no window."""
    checked_claim((start, end))  # refused now, not after the search
    return Goal(Window(start, end), partial(prove_on_window, start=start, end=end))
