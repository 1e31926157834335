"""Windows of samples that are learned again while a loop runs: each from where the last one ended, within a budget."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

from trackable.certificates.certified import Certified, learn_certified
from trackable.control.online import Late, LearningResult
from trackable.gp.samples import Samples
from trackable.learning.learner import FUNCTION
from trackable.learning.space import SearchSpace

Clock = Callable[[], float]
"""Returns seconds."""


@dataclass
class WindowLearner:
    """A learner for `simulate_online` whose references have the hyperparameters of the `last` one.

    The function is learned again for each window, beginning with the places at which the last one was held back, and is
    proved for all times. What takes longer than `budget` [s] by the `clock` is `Late`: then the old reference stays,
    which is certified for ever. `seconds` are what the windows have taken. Where hyperparameters no longer suit the
    samples, learn them again (`certified_learner`), and begin another learner with these.
    """

    last: Certified
    budget: float = float("inf")
    clock: Clock = perf_counter
    seconds: list[float] = field(default_factory=list)

    def __call__(self, samples: tuple[Samples, ...]) -> LearningResult:
        """Return a reference with a proof from the samples of a window; or why there is none, or none in time."""
        begun = self.clock()
        solution, plant = self.last.solution, self.last.reference.plant
        known = solution.posterior.prior.as_known()
        space = SearchSpace.around(samples, known, starts=1)
        found = learn_certified(samples, known, plant, space, learner=FUNCTION, last=solution)
        self.seconds.append(self.clock() - begun)
        if isinstance(found, Certified):
            self.last = found
        return Late(self.seconds[-1], self.budget) if self.seconds[-1] > self.budget else found
