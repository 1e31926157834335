"""Learning with a proof: fit, try to prove, give the proof more room or the fit more time, repeat."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from trackable.certificates.certificate import Certificate
from trackable.certificates.goal import Goal, for_all_times
from trackable.certificates.outcome import Counterexample, Unproved
from trackable.certificates.prove import reference_period
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
_MOST_ROUNDS = 30


@dataclass(frozen=True)
class Round:
    """One fit on the way: bounds drawn in by `backoff`, l there, and whether that is `proved`."""

    backoff: float
    objective: float
    proved: bool


@dataclass(frozen=True)
class Certified:
    """A learned reference with its proof.

    Bounds were drawn in by `backoff` (a part of their width), which costs `cost` in l against the smallest back-off
    that the optimiser itself needs; `rounds` counts the fits that were tried, each of them several programs.
    """

    solution: Solution
    reference: Reference
    certificate: Certificate
    backoff: float
    cost: float
    rounds: int

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
    on_round: Callable[[Round], object] = lambda done: None,
) -> Certified | NoSolution | Counterexample | Unproved:
    """The best reference that keeps its bounds provably; otherwise what stands in the way. Deterministic.

    The goal is all times where none is given. `on_round` hears of each fit.
    """
    goal = goal or for_all_times(samples, prior, plant)
    rounds = 0
    while True:
        first = best_solution(_problem(samples, prior, plant, space, goal, ROUNDING_BACKOFF))
        found, backoff = first, ROUNDING_BACKOFF
        while True:
            rounds += 1
            if not isinstance(found, Solution):
                return found
            reference = Reference(found.posterior.signals, plant)
            outcome = goal.prove(reference)
            on_round(Round(backoff, found.objective, isinstance(outcome, Certificate)))
            if isinstance(outcome, Certificate):
                assert isinstance(first, Solution)
                return Certified(found, reference, outcome, backoff, found.objective - first.objective, rounds)
            if goal.asks_beyond(_failed_at(outcome)):
                break
            backoff = max(10 * backoff, 4 * _relative_error(reference))
            if backoff > _LARGEST_BACKOFF or rounds >= _MOST_ROUNDS:
                return outcome
            found = continued(found, _problem(samples, prior, plant, space, goal, backoff))
        longer = goal.longer(_failed_at(outcome))
        if longer is None or rounds >= _MOST_ROUNDS:
            return outcome
        goal = longer


def _problem(
    samples: tuple[Samples, ...],
    prior: JointPrior,
    plant: ConstrainedSystem,
    space: SearchSpace,
    goal: Goal,
    backoff: float,
) -> ConstrainedProblem:
    """Half of the back-off is kept between the times of the program too; the other half is the program's own room."""
    return ConstrainedProblem(
        samples,
        prior,
        space,
        tuple(Constraint(_drawn_in(q, backoff / 2), goal.times, backoff / 2) for q in plant.quantities),
    )


def _drawn_in(quantity: Quantity, by: float) -> Quantity:
    return replace(quantity, bounds=quantity.bounds.shrunk(by * quantity.bounds.width))


def _failed_at(outcome: Counterexample | Unproved) -> float:
    return outcome.time if isinstance(outcome, Counterexample) else outcome.box[0]


def _relative_error(reference: Reference) -> float:
    """The largest error of float64 evaluation in a period or soon after the samples, as a part of a bound's width."""
    latest = max(float(np.max(np.abs(signal.centres))) for signal in reference.signals)
    until = 1e3 * (reference_period(reference) or latest)
    errors = evaluation_errors(reference, until)
    return max(errors[q.name] / q.bounds.width for q in reference.quantities)
