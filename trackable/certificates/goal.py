"""What is claimed of a certified reference: at which times its bounds are constrained, and how they are proved."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, Self

from trackable.certificates.prove import Outcome, prove, prove_on_window, prove_while_settling
from trackable.gp.joint import JointPrior
from trackable.gp.period import has_period
from trackable.gp.samples import Samples
from trackable.learning.index_set import AllPhases, IndexSet, Window
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.reference import Reference

Claim = Literal["all_times", "all_phases"] | tuple[float, float]
"""All times of a kernel that decays, all phases of a periodic one, or the window from start to end [s]."""

_LONGER, _FAR = 1.5, 1e3


@dataclass(frozen=True)
class Goal:
    """Bounds are constrained at `times` and proved by `prove`, which may cover later times too if the goal `grows`."""

    times: IndexSet
    prove: Callable[[Reference], Outcome]
    grows: bool = False

    def asks_beyond(self, failed_at: float) -> bool:
        """Whether a proof that fails at this time [s] fails where nothing was constrained."""
        return self.grows and isinstance(self.times, Window) and failed_at > self.times.end

    def longer(self, failed_at: float) -> Self | None:
        """Return the goal with constraints beyond a time [s] at which it failed; None where that is too far away."""
        assert isinstance(self.times, Window), "only a window grows"
        if not failed_at < _FAR * self.times.end:
            return None
        return replace(self, times=Window(self.times.start, _LONGER * failed_at))


def goal_for(claim: Claim, samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    """Return the goal of a claim. Raises ValueError where the prior's kernels do not suit it."""
    if isinstance(claim, tuple):
        return on_window(*claim)
    if reason := refusal(claim, prior):
        raise ValueError(f"claim: {reason}")
    return for_all_times(samples, prior, plant)


def refusal(claim: Claim, prior: JointPrior) -> str | None:
    """Return why this claim cannot be proved with these kernels; None where they suit it."""
    kernels = ", ".join(type(part.kernel).__name__ for part in prior.parts)
    if claim == "all_phases" and not has_period(prior):
        return f"all_phases needs periodic kernels of one period, got {kernels}"
    if claim == "all_times" and has_period(prior):
        return f"all_times needs kernels that decay, got {kernels}; all_phases is the claim for periodic ones"
    return None


def for_all_times(samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    """Return the goal for every real t ≥ 0, by the claim that suits the kernels.

    With one period whatever is learned, all phases are constrained. Otherwise a window from 0 on is constrained, which
    grows where later times fail, and an envelope that decays proves all times after it.
    """
    if has_period(prior):
        return Goal(AllPhases(), prove)
    first, last = min(float(s.times[0]) for s in samples), max(float(s.times[-1]) for s in samples)
    return Goal(Window(0.0, 2 * last - first + plant.sampling_time), prove_while_settling, grows=True)


def on_window(start: float, end: float) -> Goal:
    """Return the goal for every real t from `start` to `end` [s]."""
    return Goal(Window(start, end), partial(prove_on_window, start=start, end=end))
