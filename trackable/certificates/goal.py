"""What a certified reference has to be proved for: at which times its bounds are asked, and by which proof."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Self

from trackable.certificates.prove import Outcome, prove, prove_on_window, prove_while_settling
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.base import Kernel
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.samples import Samples
from trackable.learning.index_set import AllPhases, IndexSet, Window
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.reference import Reference

_LONGER, _FAR = 1.5, 1e3


@dataclass(frozen=True)
class Goal:
    """Bounds are constrained at `times` and proved by `prove`; a growing goal is asked again where later times fail."""

    times: IndexSet
    prove: Callable[[Reference], Outcome]
    grows: bool = False

    def asks_beyond(self, failed_at: float) -> bool:
        """Whether a proof that fails at this time [s] fails where nothing was constrained."""
        return self.grows and isinstance(self.times, Window) and failed_at > self.times.end

    def longer(self, failed_at: float) -> Self | None:
        """The same goal constrained beyond a time [s] at which it failed; None where that is too far away to help."""
        assert isinstance(self.times, Window)
        if not failed_at < _FAR * self.times.end:
            return None
        return replace(self, times=Window(self.times.start, _LONGER * failed_at))


def for_all_times(samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    """Every real t ≥ 0: all phases where all kernels have one period whatever is learned; otherwise a window from 0 on,
    that grows, and a decaying envelope from then on."""
    if has_period(prior):
        return Goal(AllPhases(_period), prove)
    first, last = min(float(s.times[0]) for s in samples), max(float(s.times[-1]) for s in samples)
    return Goal(Window(0.0, 2 * last - first + plant.sampling_time), prove_while_settling, grows=True)


def on_window(start: float, end: float) -> Goal:
    """Every real t from `start` to `end` [s], and nothing else."""
    return Goal(Window(start, end), partial(prove_on_window, start=start, end=end))


def has_period(prior: JointPrior) -> bool:
    """Whether all kernels have one period whatever is learned."""
    periods = {part.kernel.common_period for part in prior.parts}
    names = [name for name in prior.hyperparameters if name.endswith("period")]
    kept = not {*names} & {*prior.learned}
    plain = names == ["period"] and all(isinstance(part.kernel, Periodic) for part in prior.parts)
    return len(periods) == 1 and None not in periods and (kept or plain)


def _period(kernels: Sequence[Kernel]) -> float:
    period = kernels[0].common_period
    assert period is not None
    return period
