"""How references are learned: a table of methods, each with the claim that is proved about its reference."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated

import numpy as np
from pydantic import Field, PositiveInt, model_validator

from pipeline.published.algorithm1 import AS_PUBLISHED as PUBLISHED_READING
from pipeline.published.algorithm1 import SOUND as SOUND_READING
from pipeline.published.algorithm1 import Reading, Run, Trace, algorithm1
from pipeline.published.periodic import all_phases, on_grid, on_intervals
from pipeline.published.scalar import state_and_input
from pipeline.yaml_file import Fields
from trackably.arrays import Array
from trackably.certificates.certified import Attempt, Certified, learn_certified
from trackably.certificates.goal import Goal
from trackably.certificates.prove import Failure, Outcome, prove
from trackably.checker.certificate import Instants
from trackably.gp.joint import JointPrior, period_of
from trackably.gp.samples import Samples
from trackably.learning import learner
from trackably.learning.constraint import Constraint
from trackably.learning.learner import Learner
from trackably.learning.problem import ActiveBound, ConstrainedProblem, NoSolution, Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening


class Algorithm1(Fields):
    """The block `algorithm1` of params.yaml: run Algorithm 1 from k̄ = `first_step`, and give up after `last_step`."""

    first_step: PositiveInt
    last_step: PositiveInt

    @model_validator(mode="after")
    def _ordered(self) -> "Algorithm1":
        if self.last_step < self.first_step:
            raise ValueError(f"expected first_step ≤ last_step, got {self.first_step} and {self.last_step}")
        return self


class Periodic(Fields):
    """The block `periodic` of params.yaml, for methods that constrain periodic references.

    Methods constrain the steps 0 … `last_step`, or in η = `intervals` intervals the time of these steps. `backoff` is
    the part of each bound's width that the optimiser keeps free.
    """

    last_step: PositiveInt
    intervals: PositiveInt
    backoff: Annotated[float, Field(gt=0, le=0.01)]


@dataclass(frozen=True)
class LearnedReference:
    """The result of a method: the reference, the `prior` with the learned hyperparameters, and its `objective` J.

    J = l + D: l is the negative log marginal likelihood, and D the cost of the `active_bounds`. If no bound is active,
    the reference is the posterior mean, and J = l. `method` is the method's name. `final_step` is k̄ at the end of
    Algorithm 1, and `fits` the number of nonlinear programs that were solved; each is None for methods without it.
    """

    method: str
    prior: JointPrior
    reference: Reference
    objective: float
    active_bounds: tuple[ActiveBound, ...] = ()
    final_step: int | None = None
    fits: int | None = None

    @property
    def price_of_bounds(self) -> float:
        """D, what the bounds cost for the learned hyperparameters."""
        return sum((bound.price for bound in self.active_bounds), start=0.0)

    @property
    def nlml(self) -> float:
        """l, the negative log marginal likelihood of the learned hyperparameters."""
        return self.objective - self.price_of_bounds


@dataclass(frozen=True)
class Task:
    """What a method learns from: `algorithm1` and `periodic` are blocks of params.yaml, if the experiment has them.

    The `tightening` of the plant's bounds is None if the experiment has no disturbance.
    """

    samples: tuple[Samples, ...]
    prior: JointPrior
    plant: ConstrainedSystem
    space: SearchSpace
    goal: Goal
    algorithm1: Algorithm1 | None = None
    periodic: Periodic | None = None
    tightening: Tightening | None = None

    @property
    def problem(self) -> ConstrainedProblem:
        """The learning problem without constraints."""
        return ConstrainedProblem(self.samples, self.prior, self.space)


@dataclass(frozen=True)
class Fit:
    """What a method found: the solution, columns of a table of iterations, and the trace if it is Algorithm 1."""

    solution: Solution
    iterations: Mapping[str, Array] = field(default_factory=dict)
    trace: Trace | None = None

    def learned(self, method: str, plant: ConstrainedSystem) -> LearnedReference:
        """Return the reference that the method has learned for a plant, with what is known about it."""
        found, trace = self.solution, self.trace
        reference, about = Reference(found.signals, plant), (found.objective, found.active_bounds)
        counts = (None, found.fits) if trace is None else (int(trace["k_bar"][-1]), None)
        return LearnedReference(method, found.posterior.prior, reference, *about, *counts)


NotLearned = NoSolution | Failure | Run
"""A method found no reference; the `explanation` is a sentence that says why."""


@dataclass(frozen=True)
class Method:
    """An entry of the table of methods.

    The experiment's claim is proved about each reference, or with `at_instants` only that bounds are kept at the
    sampling instants. If `must_be_proved` holds, a reference without a proof is an error; otherwise the metrics say
    what the proof lacks, or by how much a bound is broken. `needs` are the blocks of params.yaml that the method reads,
    and `check` raises ValueError or TypeError for a system or prior that the method cannot treat. If the method
    `is_robust`, it learns within bounds that are tightened for disturbances, and figures of disturbed loops show it.
    Other figures leave out a reference if the method `looks_like` was used too, and draw its curve only if it
    `has_own_curve`.
    """

    name: str
    learn: Callable[[Task], Fit | NotLearned]
    at_instants: bool = False
    must_be_proved: bool = False
    needs: tuple[str, ...] = ()
    check: Callable[[ConstrainedSystem, JointPrior], object] = lambda plant, prior: None
    looks_like: str | None = None
    has_own_curve: bool = True
    is_robust: bool = False

    def prove(self, goal: Goal, reference: Reference) -> Outcome:
        """Return a proof of the method's claim about a reference, or what refutes it, or what a proof lacks."""
        return prove(reference, Instants() if self.at_instants else goal.claim)


def best(task: Task, constraints: tuple[Constraint, ...] = ()) -> Solution | NoSolution:
    """Maximise the likelihood under constraints; without constraints, this is the usual Gaussian process regression."""
    return best_solution(replace(task.problem, constraints=constraints))


def _certified(learner: Learner, task: Task) -> Fit | NotLearned:
    attempts: list[Attempt] = []
    found = learn_certified(task.problem, task.plant, task.goal, attempts.append, learner)
    if not isinstance(found, Certified):
        return found
    columns = ("backoff", "objective", "proved")
    table = {name: np.array([getattr(attempt, name) for attempt in attempts], dtype=float) for name in columns}
    return Fit(found.solution, {"round": np.arange(1.0, len(attempts) + 1), **table})


_TABLE = ("k_bar", "mean_bound", "growth_lower", "growth_upper", "derivative_bound")


def _by_algorithm1(reading: Reading, task: Task) -> Fit | NotLearned:
    steps = task.algorithm1
    assert steps, "the experiment was checked for what its methods need"
    between = steps.first_step, steps.last_step
    run = algorithm1(task.samples, task.prior, task.plant, task.space, reading, *between)
    if not isinstance(run.outcome, Solution):
        return run
    shown = {*task.prior.learned, *_TABLE}
    return Fit(run.outcome, {name: values for name, values in run.trace.items() if name in shown}, run.trace)


def check_periodic(plant: ConstrainedSystem, prior: JointPrior) -> None:
    """Raise ValueError for a system that is not scalar, and TypeError for a kernel that is not periodic."""
    state_and_input(plant)
    period_of([part.kernel for part in prior.parts])


def _constrained(
    constraints: Callable[[Task], tuple[Constraint, ...]],
    task: Task,
    iterations: Callable[[Task, Solution], Mapping[str, Array]] = lambda task, found: {},
) -> Fit | NotLearned:
    found = best(task, constraints(task))
    return Fit(found, iterations(task, found)) if isinstance(found, Solution) else found


def at_all_phases(task: Task) -> tuple[Constraint, ...]:
    """Return constraints of every bounded quantity at all phases of the period."""
    return all_phases(task.plant, periodic_of(task).backoff)


def in_intervals(task: Task, count: int | None = None) -> tuple[Constraint, ...]:
    """Return the constraints of program (8), as published; the `count` η is that of the experiment by default."""
    wanted = periodic_of(task)
    return on_intervals(task.plant, wanted.last_step, count or wanted.intervals, wanted.backoff)


def _rounds(task: Task, found: Solution) -> Mapping[str, Array]:
    """Return the rounds of the exchange method that led to the best solution, as columns of a table."""
    log_theta = np.array([r.log_theta for r in found.rounds]).reshape(len(found.rounds), -1)
    return {
        "round": np.arange(1.0, len(found.rounds) + 1),
        **dict(zip(task.prior.learned, np.exp(log_theta).T, strict=False)),
        "objective": np.array([r.objective for r in found.rounds]),
        "relative_margin": np.array([r.margin for r in found.rounds]),
        "places": np.array([float(r.places) for r in found.rounds]),
    }


def periodic_of(task: Task) -> Periodic:
    """Return the block of params.yaml that methods for periodic references read."""
    assert task.periodic, "the experiment was checked for what its methods need"
    return task.periodic


def _within_tightened_bounds(task: Task) -> Fit | NotLearned:
    assert task.tightening, "the experiment was checked for what its methods need"
    return JOINT.learn(replace(task, plant=task.tightening.plant))


UNCONSTRAINED = Method("unconstrained", partial(_constrained, lambda task: ()))
HYPERPARAMETERS = Method("hyperparameters", partial(_certified, learner.HYPERPARAMETERS), must_be_proved=True)
JOINT = Method("joint", partial(_certified, learner.JOINT), must_be_proved=True)
AS_PUBLISHED = Method(
    PUBLISHED_READING.name,
    partial(_by_algorithm1, PUBLISHED_READING),
    at_instants=True,
    needs=("algorithm1",),
    check=lambda plant, prior: state_and_input(plant),
)
SOUND = replace(
    AS_PUBLISHED,
    name=SOUND_READING.name,
    learn=partial(_by_algorithm1, SOUND_READING),
    looks_like=HYPERPARAMETERS.name,
)
EXACT = Method(
    "exact",
    partial(_constrained, at_all_phases, iterations=_rounds),
    must_be_proved=True,
    needs=("periodic",),
    check=check_periodic,
    looks_like=HYPERPARAMETERS.name,
)
INTERVALS = Method("intervals", partial(_constrained, in_intervals), needs=("periodic",), check=check_periodic)
# The grid has the instants of the first steps only; later steps fall on other phases of the period.
GRID = replace(
    INTERVALS,
    name="grid",
    learn=partial(_constrained, lambda task: on_grid(task.plant, periodic_of(task).last_step)),
    has_own_curve=False,
)
ROBUST = replace(JOINT, name="robust", learn=_within_tightened_bounds, needs=("disturbance",), is_robust=True)

REQUIRED = (UNCONSTRAINED, HYPERPARAMETERS, JOINT)
"""Methods that every experiment compares; loops are closed on the references of the first and the last."""

METHODS = {method.name: method for method in (*REQUIRED, AS_PUBLISHED, SOUND, EXACT, INTERVALS, GRID, ROBUST)}


def methods_in_figures(learned: Collection[str]) -> list[Method]:
    """Return the methods of `learned` references that figures without disturbances show, in the table's order."""
    shown = [method for name, method in METHODS.items() if name in learned and not method.is_robust]
    return [method for method in shown if method.looks_like not in learned]
