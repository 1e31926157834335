"""Learn a reference again from each window of samples, starting from the result of the last window."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np

from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.claim import AllPhases, AllTimes
from trackably.certificates.goal import for_all_times_again
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.learning.learner import FUNCTION, JOINT, Learner
from trackably.learning.problem import NoSolution, Solution
from trackably.learning.space import SearchSpace

Clock = Callable[[], float]
"""Returns seconds."""

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
LearnFromWindow = Callable[[tuple[Samples, ...]], LearningResult]
"""Returns a reference with a proof, in absolute time, from the samples of a window; or the reason why there is none."""


@dataclass
class WindowLearner:
    """Learn from each window, starting from the result of the `last` one: a `LearnFromWindow` with a memory.

    The function is learned again for each window, starting with the places at which the last one had active bounds, and
    is proved for all times. In every `moving_every`-th window the hyperparameters are learned too, from their last
    values to the next local minimum of J, which takes a few times longer; with 0 they are fixed. If learning takes
    longer than `budget` [s] by the `clock`, the answer is `BudgetExceeded`: the old reference then stays in use, which
    is certified for ever, and the next window starts from the late result. `seconds` are the durations of the windows.

    ValueError: hyperparameters are to be learned, but all of them are known.
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
        """Return a reference with a proof from the samples of a window.

        Or the reason why there is none, or none in time.
        """
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
        """Return the learner of function and hyperparameters, and the last solution with its
        hyperparameters as learned ones.
        """
        values = self.last.solution.posterior.prior.hyperparameters
        log_theta = np.log([values[name] for name in self._prior.learned])
        return _MOVING, _with_prior(self.last.solution, self._prior.with_log_hyperparameters(log_theta))


def _with_prior(solution: Solution, prior: JointPrior) -> Solution:
    return replace(solution, posterior=replace(solution.posterior, prior=prior))


def holds_for_all_times(learned: Certified) -> bool:
    """Whether the certificate covers every step from any time on."""
    return isinstance(learned.certificate.claim, AllTimes | AllPhases)
