"""Learning in a running control loop: `Relearner` takes samples by name and returns references that can be saved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter

from trackably.arguments import instance, real, whole
from trackably.arrays import ArrayLike
from trackably.certificates.certified import Certified
from trackably.certificates.judge import judged
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.robust import robust_of
from trackably.control.stepping import Plan, SteppedController, StepResult
from trackably.fit import Fit
from trackably.learning.problem import NoSolution
from trackably.learning.space import SearchSpace
from trackably.reference import TrackableReference
from trackably.request.samples import SamplesLike, names_of_each, same_states
from trackably.streams.window_learner import BudgetExceeded, Clock, WindowLearner, holds_for_all_times
from trackably.systems.sampling import sampled_signals


@dataclass
class Relearner:
    """Learn a reference again from each window of samples that arrives, while a loop runs.

    Each window starts from the result of the last one, as in a `WindowLearner`: from its hyperparameters, and from the
    times at which bounds were active. Prior means stay those of the first reference, and so does noise that was learned
    without bounds. In every `moving_every`-th window the hyperparameters are learned again too, which takes a few times
    longer; with 0 they are fixed. Times of samples are those of the loop: step k is at k T_s.

    `reference` is the one that the loop tracks, at first the given one. It holds for all times, so that the loop can
    track it until there is another one. `step` switches to the last one that was learned within the `budget` [s], if
    the controller has a plan that ends on it; to switch by another rule, set `reference`. `seconds` are the durations
    of the windows by the `clock`, late ones included. `noise_std` is needed if several states show one flat output, as
    in `learn_reference`.

    TypeError or ValueError: another argument is invalid, the reference is proved for a window only, or hyperparameters
    are to be learned but all of them are known.
    """

    reference: TrackableReference
    budget: float | None = None
    moving_every: int = 0
    noise_std: Mapping[str, float] | None = None
    clock: Clock = perf_counter
    _windows: WindowLearner = field(init=False, repr=False)
    _learned: TrackableReference | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        instance("reference", self.reference, TrackableReference, "one that learn_reference returns")
        first = _certified(self.reference)
        if not holds_for_all_times(first):
            raise ValueError(
                "reference: a loop may need it for ever, so that it has to be proved for all times, but it is "
                f"for {first.certificate.claim} only; learn it with the claim 'all_times' or 'all_phases'"
            )
        budget = float("inf") if self.budget is None else real("budget", self.budget)
        if not budget > 0:
            raise ValueError(f"budget: expected a positive number of seconds, got {self.budget!r}")
        every = whole("moving_every", self.moving_every, least=0)
        self._windows = WindowLearner(first, budget, self.clock, moving_every=every)

    @property
    def seconds(self) -> list[float]:
        """The duration of each window's learning [s]."""
        return self._windows.seconds

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
        kinds = names_of_each(plant, self.reference.sampled)
        _, seen = sampled_signals(plant, same_states("samples", samples, plant, kinds, self.noise_std))
        found = self._windows(seen)
        if not isinstance(found, Certified):
            return judged(found)
        self._learned = _with_proof(found, self.reference)
        return self._learned

    def step(
        self, controller: SteppedController, k: int, state: ArrayLike, initial_guess: ArrayLike | None = None
    ) -> StepResult:
        """Return the controller's plan at step `k` from `state` (n,), or the reason why there is
        none, as `Controller.step` does.

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


def _certified(reference: TrackableReference) -> Certified:
    """Return a reference in the form from which a search can continue."""
    fit = reference.fit
    space = SearchSpace.around(fit.samples, fit.prior)
    return Certified(fit.solution, reference.reference, reference.certificate, 0.0, 0.0, 0, space)


def _with_proof(found: Certified, last: TrackableReference) -> TrackableReference:
    """Return the result as a reference for the plant of the last one; its l without bounds is that of the same θ."""
    fit = Fit.of(found.reference, found.solution, found.solution.posterior, ())
    certificate = replace(found.certificate, robust=robust_of(last.tightening))
    return TrackableReference(fit, certificate, tightening=last.tightening)
