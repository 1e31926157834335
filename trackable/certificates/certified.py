"""Learning with a proof: fit, try to prove; then give the proof more room, or constrain a longer time; repeat."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from trackable.certificates.certificate import Certificate
from trackable.certificates.goal import Goal, for_all_times
from trackable.certificates.outcome import Counterexample, Unproved
from trackable.certificates.prove import Failure, reference_period
from trackable.certificates.rounding.references import evaluation_errors
from trackable.gp.joint import JointPrior
from trackable.gp.samples import Samples
from trackable.learning.constraint import ROUNDING_BACKOFF, Constraint
from trackable.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackable.learning.search import best_solution, continued
from trackable.learning.space import SearchSpace
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.quantity import Quantity
from trackable.systems.reference import Reference

_LARGEST_BACKOFF = 1e-2
_MOST_ATTEMPTS = 30


@dataclass(frozen=True)
class Attempt:
    """A fit with bounds drawn in by `backoff` (a part of their width), l there, and whether it could be `proved`."""

    backoff: float
    objective: float
    proved: bool


@dataclass(frozen=True)
class Certified:
    """A learned reference with its proof.

    Bounds were drawn in by `backoff` (a part of their width). This costs `cost` in l, compared with the smallest
    back-off, which the optimiser itself needs. `attempts` counts the fits that were tried, each of several programs.
    """

    solution: Solution
    reference: Reference
    certificate: Certificate
    backoff: float
    cost: float
    attempts: int

    @property
    def explanation(self) -> str:
        drawn = f"bounds drawn in by {self.backoff:.1g} of their width, at a cost of {self.cost:.2g} in l"
        return f"{self.certificate.explanation}; {drawn}"


def learn_certified(
    samples: tuple[Samples, ...],
    prior: JointPrior,
    plant: ConstrainedSystem,
    space: SearchSpace,
    goal: Goal | None = None,
    on_attempt: Callable[[Attempt], object] = lambda attempt: None,
) -> Certified | NoSolution | Counterexample | Unproved:
    """Return the best reference that provably keeps its bounds; otherwise what stands in the way. Deterministic.

    The goal is all times where none is given. `on_attempt` is called after each fit and its attempted proof.
    """
    goal = goal or for_all_times(samples, prior, plant)
    learning = _Learning(samples, prior, plant, space, on_attempt)
    outcome = learning.towards(goal)
    while isinstance(outcome, Failure) and goal.asks_beyond(_failed_at(outcome)) and learning.may_go_on:
        longer = goal.longer(_failed_at(outcome))
        if longer is None:
            break
        goal = longer
        outcome = learning.towards(goal)
    return outcome


@dataclass
class _Learning:
    """What is learned from, and the number of attempts so far."""

    samples: tuple[Samples, ...]
    prior: JointPrior
    plant: ConstrainedSystem
    space: SearchSpace
    on_attempt: Callable[[Attempt], object]
    attempts: int = 0

    @property
    def may_go_on(self) -> bool:
        return self.attempts < _MOST_ATTEMPTS

    def towards(self, goal: Goal) -> Certified | NoSolution | Failure:
        """Fit and try to prove, with more back-off each time, unless the proof fails where nothing is constrained."""
        backoff = ROUNDING_BACKOFF
        first = found = best_solution(self._problem(goal, backoff))
        while isinstance(found, Solution):
            reference = Reference(found.posterior.signals, self.plant)
            outcome = goal.prove(reference)
            self.attempts += 1
            self.on_attempt(Attempt(backoff, found.objective, isinstance(outcome, Certificate)))
            if isinstance(outcome, Certificate):
                assert isinstance(first, Solution), "every later fit follows a first one"
                cost = found.objective - first.objective
                return Certified(found, reference, outcome, backoff, cost, self.attempts)
            if goal.asks_beyond(_failed_at(outcome)) or not self.may_go_on:
                return outcome
            backoff = max(10 * backoff, 4 * _relative_error(reference))
            if backoff > _LARGEST_BACKOFF:
                return outcome
            found = continued(found, self._problem(goal, backoff))
        return found

    def _problem(self, goal: Goal, backoff: float) -> ConstrainedProblem:
        """Keep half of the back-off between the times of the program too; the other half is the program's own room."""
        constraints = [Constraint(_drawn_in(q, backoff / 2), goal.times, backoff / 2) for q in self.plant.quantities]
        return ConstrainedProblem(self.samples, self.prior, self.space, tuple(constraints))


def _drawn_in(quantity: Quantity, by: float) -> Quantity:
    return replace(quantity, bounds=quantity.bounds.shrunk(by * quantity.bounds.width))


def _failed_at(outcome: Failure) -> float:
    """The time [s] at which a bound is broken, or from which on nothing is proved."""
    return outcome.time if isinstance(outcome, Counterexample) else outcome.box[0]


def _relative_error(reference: Reference) -> float:
    """The largest error of float64 evaluation in a period or soon after the samples, as a part of a bound's width."""
    latest = max(float(np.max(np.abs(signal.centres))) for signal in reference.signals)
    until = 1e3 * (reference_period(reference) or latest)
    errors = evaluation_errors(reference, until)
    return max(errors[q.name] / q.bounds.width for q in reference.quantities)
