"""Learning in a running control loop: `Relearner` takes samples by name and returns references that can be saved."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from trackably.arguments import instance, positive, whole
from trackably.arrays import ArrayLike
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.claim import times_of
from trackably.certificates.goal import for_all_times
from trackably.certificates.judge import judge
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.checker.certificate import AllPhases, AllTimes
from trackably.control.stepping import Plan, StepResult
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.learning.learner import FUNCTION, JOINT
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackably.learning.space import SearchSpace
from trackably.reference.fit import Fit
from trackably.reference.request import Measurements, SamplesLike
from trackably.reference.trackable import TrackableReference

if TYPE_CHECKING:
    from trackably.control.controller import Controller

# Learn a reference again from each window of samples, starting from the result of the last window.

Clock = Callable[[], float]
"""Returns the present time in seconds, such as `time.perf_counter`."""

_MOVING = replace(JOINT, fallback=None)


@dataclass(frozen=True)
class BudgetExceeded:
    """Learning and proof took `seconds`, longer than the `budget` [s]."""

    seconds: float
    budget: float

    @property
    def explanation(self) -> str:
        return f"learning and proof took {self.seconds:.3g} s, longer than the budget of {self.budget:.3g} s"


LearningResult = Certified | NoSolution | Counterexample | Unproved | BudgetExceeded
"""A reference with a proof, in absolute time, from the samples of a window; or the reason why there is none."""


def holds_for_all_times(learned: Certified | TrackableReference) -> bool:
    """Whether the certificate covers every step of a loop, at whatever step the loop begins."""
    return isinstance(learned.certificate.claim, AllTimes | AllPhases)


@dataclass
class Relearner:
    """Learn a reference again from each window of samples that arrives, while a loop runs.

    Each window starts from the result of the last one, even if that was late: from its hyperparameters, and from the
    times at which bounds were active. Prior means stay those of the first reference, and so does noise that was learned
    without bounds. In every `moving_every`-th window the hyperparameters are learned too, from their last values to the
    next local minimum of the objective J, which takes a few times longer; with 0 they are fixed. Times of samples are
    those of the loop: step k is at k T_s.

    `reference` is what the loop tracks, at first the given reference. It holds for all times, so that the loop can
    track it until there is another one. `step` switches to the last reference learned within the `budget` [s], if
    the controller has a plan that ends on it; to switch by another rule, set `reference`. The budget does not end a
    call that takes longer. `seconds` are the durations of the windows by the `clock`, late ones included. `noise_std`
    is needed if several states show one flat output, as in `learn_reference`.

    TypeError or ValueError: another argument is invalid, the reference is proved for a window only, or hyperparameters
    are to be learned but all of them are known.
    """

    reference: TrackableReference
    budget: float | None = None
    moving_every: int = 0
    noise_std: Mapping[str, float] | None = None
    clock: Clock = perf_counter
    seconds: list[float] = field(default_factory=list, init=False)
    _last: Solution = field(init=False, repr=False)
    _prior: JointPrior = field(init=False, repr=False)
    _learned: TrackableReference | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        instance("reference", self.reference, TrackableReference, "one that learn_reference returns")
        self._last = self.reference.fit.solution
        self._prior = self._last.posterior.prior
        if not holds_for_all_times(self.reference):
            proved = times_of(self.reference.certificate.claim)
            raise ValueError(
                "reference: a loop may need it for ever, so that it has to be proved for all times, but it is for "
                f"{proved} only; learn it with the claim 'all_times' or 'all_phases'"
            )
        if self.budget is not None:
            positive("budget [s]", self.budget)
        if whole("moving_every", self.moving_every, least=0) and not self._prior.learned:
            raise ValueError(
                "moving_every: expected 0, because all hyperparameters of the reference are known and none can be "
                f"learned again, got {self.moving_every}"
            )

    def __call__(
        self, samples: SamplesLike
    ) -> TrackableReference | BudgetExceeded | NoSolution | Counterexample | Unproved:
        """Return a reference with a proof, learned from a window of samples; or the reason why there is none in time.

        `reference` does not change until the next `step`, because the loop can switch only if the state then allows it.
        The samples are of the same states as those of the first reference, and are used in this window only. Every
        answer has an `explanation`. The next window starts from the last proved result, even a late one. TypeError or
        ValueError: the samples do not fit.
        """
        plant = self.reference.reference.plant
        learned_from = Measurements.of(self.reference.sampled, plant, self.noise_std, centres=None)
        seen = learned_from.others("samples", samples)
        begun = self.clock()
        found = self._learn(seen.signals)
        self.seconds.append(self.clock() - begun)
        if isinstance(found, Certified):
            self._last = found.solution
        if self.budget is not None and self.seconds[-1] > self.budget:
            return BudgetExceeded(self.seconds[-1], self.budget)
        if not isinstance(found, Certified):
            return judge(found)
        # The result is compared with the fit without bounds that has the same hyperparameters.
        fit = Fit.of(found.reference, found.solution, found.solution.posterior, ())
        tightening = self.reference.tightening
        certificate = found.certificate.with_robust(tightening)
        self._learned = TrackableReference.of(certificate, (), tightening, fit=fit)
        return self._learned

    def _learn(self, samples: tuple[Samples, ...]) -> LearningResult:
        """Learn the function, and the hyperparameters in every `moving_every`-th window, from the last solution."""
        solution, plant = self._last, self.reference.reference.plant
        learner, prior = FUNCTION, solution.posterior.prior.as_known()
        if self.moving_every and (len(self.seconds) + 1) % self.moving_every == 0:
            values = solution.posterior.prior.hyperparameters
            learner = _MOVING
            prior = self._prior.with_log_hyperparameters(np.log([values[name] for name in self._prior.learned]))
        near = replace(solution, posterior=replace(solution.posterior, prior=prior))
        problem = ConstrainedProblem(samples, prior, SearchSpace.around(samples, prior, starts=1))
        return learn_certified(problem, plant, for_all_times(samples, prior, plant), learner=learner, last=near)

    def step(
        self, controller: Controller, k: int, state: ArrayLike, initial_guess: ArrayLike | None = None
    ) -> StepResult:
        """Return the controller's plan at step `k` from `state` (n,), or why there is none, as `Controller.step` does.

        The first step after a reference was learned tries to switch to it. If there is a plan that ends on it and keeps
        the bounds strictly, not only up to a tolerance, that plan is returned, and `reference` is the new one from then
        on. Otherwise the loop stays on the old reference, on which plans can always be continued, and discards the new
        one.
        """
        learned, self._learned = self._learned, None
        if learned is not None:
            answer = controller.step(k, state, learned, initial_guess)
            if isinstance(answer, Plan) and answer.keeps_sets:
                self.reference = learned
                return answer
        return controller.step(k, state, self.reference, initial_guess)
