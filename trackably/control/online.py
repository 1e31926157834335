"""A loop along references that are learned while it runs: a new one is accepted only if it keeps every guarantee."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np

from trackably.arrays import Array, ArrayLike
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.claim import AllPhases, AllTimes
from trackably.certificates.goal import for_all_times_again
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.control.controller import Controller
from trackably.control.simulation import ClosedLoop, concatenate, simulate
from trackably.control.stepping import Infeasible, Unsolved
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.learning.learner import FUNCTION, JOINT, Learner
from trackably.learning.problem import NoSolution, Solution
from trackably.learning.space import SearchSpace
from trackably.systems.reference import Reference

Clock = Callable[[], float]
"""Returns seconds."""

_MOVING = replace(JOINT, second_choice=None)


@dataclass(frozen=True)
class BudgetExceeded:
    """A reference was not ready within the `budget` [s] for learning and proof: that took `seconds`."""

    seconds: float
    budget: float

    @property
    def explanation(self) -> str:
        return f"learning and proof took {self.seconds:.3g} s, longer than the budget of {self.budget:.3g} s"


LearningResult = Certified | NoSolution | Counterexample | Unproved | BudgetExceeded
LearnFromWindow = Callable[[tuple[Samples, ...]], LearningResult]
"""Returns a reference with a proof, in absolute time, from the samples of a window; or why there is none."""


@dataclass
class WindowLearner:
    """Learn from each window, beginning where the `last` one ended: a `LearnFromWindow` that remembers.

    The function is learned again for each window, beginning with the places at which the last one was held back, and is
    proved for all times. In every `moving_every`-th window the hyperparameters move too, from those of the last one to
    the next local minimum of J: that takes a few times longer. With 0 they stay as they are. What takes longer than
    `budget` [s] by the `clock` is `BudgetExceeded`: then the old reference stays, which is certified for ever, and the
    next window begins where the late one ended. `seconds` are what the windows have taken.

    Raises ValueError where hyperparameters shall move and all of them are known.
    """

    last: Certified
    budget: float = float("inf")
    clock: Clock = perf_counter
    seconds: list[float] = field(default_factory=list)
    moving_every: int = 0
    _prior: JointPrior = field(init=False)

    def __post_init__(self) -> None:
        self._prior = self.last.solution.posterior.prior
        if self.moving_every and not self._prior.learned:
            raise ValueError(
                f"windows: hyperparameters that are known cannot move, got moving_every = {self.moving_every}"
            )

    def __call__(self, samples: tuple[Samples, ...]) -> LearningResult:
        """Return a reference with a proof from the samples of a window; or why there is none, or none in time."""
        begun = self.clock()
        moves = self.moving_every > 0 and (len(self.seconds) + 1) % self.moving_every == 0
        found = self._learned(samples, *(self._from_movable() if moves else self._from_known()))
        self.seconds.append(self.clock() - begun)
        if isinstance(found, Certified):
            self.last = found
        return BudgetExceeded(self.seconds[-1], self.budget) if self.seconds[-1] > self.budget else found

    def _learned(self, samples: tuple[Samples, ...], learner: Learner, near: Solution) -> LearningResult:
        prior = near.posterior.prior
        space = SearchSpace.around(samples, prior, starts=1)
        plant = self.last.reference.plant
        goal = for_all_times_again(samples, prior, plant)
        return learn_certified(samples, prior, plant, space, goal, learner=learner, last=near)

    def _from_known(self) -> tuple[Learner, Solution]:
        """Return the learner of functions, and the last solution with known hyperparameters."""
        return FUNCTION, _with_prior(self.last.solution, self.last.solution.posterior.prior.as_known())

    def _from_movable(self) -> tuple[Learner, Solution]:
        """Return the learner of both, and the last solution with its hyperparameters as learned ones."""
        values = self.last.solution.posterior.prior.hyperparameters
        log_theta = np.log([values[name] for name in self._prior.learned])
        return _MOVING, _with_prior(self.last.solution, self._prior.with_log_hyperparameters(log_theta))


def _with_prior(solution: Solution, prior: JointPrior) -> Solution:
    return replace(solution, posterior=replace(solution.posterior, prior=prior))


def receding_window(samples: tuple[Samples, ...], until: float, count: int) -> tuple[Samples, ...]:
    """Return the last `count` samples of each flat output up to the time `until` [s].

    Raises ValueError where there is none.
    """
    return tuple(_last(s, until, count) for s in samples)


def _last(samples: Samples, until: float, count: int) -> Samples:
    arrived = np.flatnonzero(samples.times <= until)[-count:]
    if not arrived.size:
        raise ValueError(f"online: no sample has arrived by {until:g} s, the first comes at {samples.times[0]:g} s")
    stencil = samples.stencil.only(arrived)
    return Samples(samples.times[arrived], samples.values[arrived], samples.relative_noise[arrived], stencil)


@dataclass(frozen=True)
class ReferenceUpdate:
    """A reference learned at step `k`, and whether the controller tracks it from then on.

    `sample_counts` are the numbers of samples of each flat output. `reason` says why the reference was `accepted` or
    not. `widening` is the least part of their widths by which the sets would have to be widened for a plan, where that
    is the reason.
    """

    k: int
    sample_counts: tuple[int, ...]
    learned: LearningResult
    accepted: bool
    reason: str
    widening: float | None = None


@dataclass(frozen=True, eq=False)
class OnlineLoop:
    """A closed loop along changing references, all updates in order, and the `reference` at the end."""

    loop: ClosedLoop
    updates: tuple[ReferenceUpdate, ...]
    reference: Reference


def simulate_online(
    controller: Controller,
    first: Certified,
    initial_state: ArrayLike,
    steps: int,
    arrivals: Iterable[tuple[int, tuple[Samples, ...]]],
    learner: LearnFromWindow,
) -> OnlineLoop:
    """Simulate the closed loop from `initial_state` (n,) at step 0, and learn the reference again at each arrival.

    The loop begins on the reference `first`. An arrival is (k, samples): a step, in increasing order, and the samples
    of the window that ends there (`receding_window`). Since the current reference is certified for all times, nothing
    is lost where a new one is not accepted. Raises ValueError where `first` is certified for less, and where arrivals
    are not in increasing order within `steps`.
    """
    if not holds_for_all_times(first):
        raise ValueError(
            f"online: the first reference must be certified for all time, but only for {first.certificate.claim}"
        )
    now, state, reference = 0, np.asarray(initial_state, dtype=float), first.reference
    parts: list[ClosedLoop] = []
    updates: list[ReferenceUpdate] = []
    for k, samples in arrivals:
        if not now <= k <= steps or (updates and k == now):
            raise ValueError(
                f"online: arrivals must come in increasing order and within {steps} steps, got {k} after {now}"
            )
        parts.append(simulate(controller, reference, state, k - now, first_step=now))
        if parts[-1].without_plan:
            return OnlineLoop(concatenate(parts), tuple(updates), reference)
        now, state = k, parts[-1].states[-1]
        learned = learner(samples)
        updates.append(decide_update(controller, k, state, samples, learned))
        if updates[-1].accepted and isinstance(learned, Certified):
            reference = learned.reference
    parts.append(simulate(controller, reference, state, steps - now, first_step=now))
    return OnlineLoop(concatenate(parts), tuple(updates), reference)


def decide_update(
    controller: Controller, k: int, state: Array, samples: tuple[Samples, ...], learned: LearningResult
) -> ReferenceUpdate:
    """Decide whether the controller may track a learned reference from `state` (n,) at step `k` on."""
    counts = tuple(len(s) for s in samples)
    if not isinstance(learned, Certified):
        why = "learned, but not proved" if isinstance(learned, Counterexample | Unproved) else "no solution"
        why = "not ready" if isinstance(learned, BudgetExceeded) else why
        return ReferenceUpdate(k, counts, learned, False, f"{why}: {learned.explanation}")
    if not holds_for_all_times(learned):
        return ReferenceUpdate(k, counts, learned, False, f"proved for {learned.certificate.claim} only")
    result = controller.step(k, state, learned.reference)
    if isinstance(result, Infeasible):
        return ReferenceUpdate(k, counts, learned, False, result.explanation, result.widening)
    if isinstance(result, Unsolved):
        return ReferenceUpdate(k, counts, learned, False, result.explanation)
    # The tolerance makes up for rounding on the reference that is tracked already. A new one must not need it.
    if not result.keeps_sets:
        reason = f"within the tolerance only: {result.explanation}"
        return ReferenceUpdate(k, counts, learned, False, reason, -result.slack)
    return ReferenceUpdate(k, counts, learned, True, result.explanation)


def holds_for_all_times(learned: Certified) -> bool:
    """Whether the certificate covers every step from now on, whenever that is."""
    return isinstance(learned.certificate.claim, AllTimes | AllPhases)
