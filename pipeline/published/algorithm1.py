"""Algorithm 1 of the paper: constrained learning of asymptotically constant references.

In each iteration, the first k̄ steps are constrained, hyperparameters are learned, and tests decide whether bounds hold
at all times from t̄ = k̄ T_s on. If a test fails, k̄ is increased by one.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from pipeline.published.periodic import on_grid
from pipeline.published.scalar import coefficients, equilibrium_input, growth_rates, interval_sets
from trackably.arrays import Array
from trackably.checker.kernels import ELEMENTARY
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.registry import name_of
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum
from trackably.learning.constraint import Constraint
from trackably.learning.exchange import Candidate
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.work import done


@dataclass(frozen=True)
class Tail:
    """Bounds of a learned signal for all t ≥ `start` [s]; every sample is earlier than `start` by more than ζ [s].

    `mean_bound` m̄ ≥ |m⁺(t) − m| and `derivative_bound` (unit per second) ≥ |ṁ⁺(t)|: over-estimates, by the triangle
    inequality and monotone decay.
    """

    start: float
    mean: float
    mean_bound: float
    derivative_bound: float

    @property
    def states(self) -> Interval:
        """The interval m ± m̄ around the prior mean m that contains the signal.

        Line 7 of the paper takes the posterior mean instead.
        """
        return Interval(self.mean - self.mean_bound, self.mean + self.mean_bound)

    def keeps_states(self, plant: ConstrainedSystem) -> bool:
        """The test of line 7: every later state lies in X."""
        state_set, _ = interval_sets(plant)
        return state_set.margin_of(self.states) >= 0

    def keeps_rates(self, rates: tuple[float, float]) -> bool:
        """The test of line 9, for both signs: the change in every later step lies in [τ_low, τ_high] T_s."""
        low, high = rates
        return low <= -self.derivative_bound and self.derivative_bound <= high

    def inputs(self, plant: ConstrainedSystem) -> Interval:
        """Return an interval that contains u_r(t) for all later t (an over-estimate).

        With e = m⁺ − m, u_r(t) = u_m + ((1 − a) e(t) + (e(t + T_s) − e(t)))/b, where u_m holds the prior mean.
        """
        a, b, _ = coefficients(plant)
        centre = equilibrium_input(plant, self.mean)
        reach = (abs(1 - a) * self.mean_bound + self.derivative_bound * plant.sampling_time) / abs(b)
        return Interval(centre - reach, centre + reach)


def decay_distance(kernel: Kernel) -> float:
    """Return ζ(θ) [s] of Assumption 4: |κ̇(r)| strictly decreases for |r| > ζ; infinite if there is no such ζ.

    A finite ζ also implies Assumption 3: κ is positive and strictly decreases in |r|. A kernel with compact support has
    these properties inside its support, and κ and κ̇ are zero outside. This suffices for bounds at later times, because
    they only need that nothing increases. Beyond the ζ of both kernels, the derivatives of a sum and of a product
    decrease, too: all terms of κ̇ are products of falling functions, and have one sign.
    """
    if isinstance(kernel, Sum | Product):
        return max(decay_distance(kernel.left), decay_distance(kernel.right))
    of = ELEMENTARY[name_of(type(kernel))](*kernel.hyperparameters.values())
    return float((of.length * of.steepest).mid) if of.decays else math.inf


def tail(signal: KernelSum, start: float) -> Tail | None:
    """Return the bounds from `start` [s] on; None if a sample is within ζ of `start`, where kernels may still grow."""
    if not start - np.max(signal.centres) > decay_distance(signal.kernel):
        return None
    kappa, rate = np.abs(signal.kernel.jet(start - signal.centres, 1)) @ np.abs(signal.weights)
    return Tail(start, signal.mean, float(kappa), float(rate))


@dataclass(frozen=True)
class Reading:
    """A reading of the paper, which leaves open the steps that iteration k̄ constrains and the states of growth rates.

    States are constrained up to step k̄ − `before`, and inputs up to the step before it, as the input at k leads to the
    state at k + 1. `growth_states` returns the interval of states for which the growth rates have to hold.
    """

    name: str
    before: int
    growth_states: Callable[[Tail, JointPosterior], Interval]

    def constraints(self, plant: ConstrainedSystem, k_bar: int) -> tuple[Constraint, ...]:
        """Return the constraints of iteration k̄. Raises ValueError for systems that are not scalar."""
        return on_grid(plant, k_bar - self.before)


def _around_posterior_mean(bounds: Tail, posterior: JointPosterior) -> Interval:
    centre = posterior.signals[0](np.array(bounds.start)).item()
    return Interval(centre - bounds.mean_bound, centre + bounds.mean_bound)


AS_PUBLISHED = Reading("as_published", 1, _around_posterior_mean)
"""The reading that reproduces the published trace. The step from k̄ − 1 to k̄ is not constrained."""

SOUND = Reading("sound", 0, lambda bounds, _: bounds.states)
"""The reading that the paper's proof supports: states up to k̄, inputs up to k̄ − 1, rates for all later states."""


@dataclass(frozen=True)
class Iteration:
    """One iteration at k̄ = `k_bar`: the solution, and the two tests of its bounds from t̄ on.

    `tail` holds the bounds and `growth_rates` are [τ_low, τ_high] per second; both are None while the ζ-test fails.
    `keeps_states` says whether all later states stay in X, and `keeps_rates` whether all later steps stay within the
    growth rates.
    """

    k_bar: int
    solution: Solution
    tail: Tail | None
    growth_rates: tuple[float, float] | None
    keeps_states: bool
    keeps_rates: bool

    @property
    def terminates(self) -> bool:
        return self.keeps_states and self.keeps_rates

    @property
    def numbers(self) -> dict[str, float]:
        """The row of a table: k̄, learned hyperparameters, bounds (NaN while the ζ-test fails) and tests (0 or 1).

        `mean_bound` m̄ is in the unit of the state, `derivative_bound` and the growth rates are per second.
        """
        prior, (low, high) = self.solution.posterior.prior, self.growth_rates or (np.nan, np.nan)
        return {
            "k_bar": float(self.k_bar),
            **{name: prior.hyperparameters[name] for name in prior.learned},
            "mean_bound": self.tail.mean_bound if self.tail else np.nan,
            "growth_lower": low,
            "growth_upper": high,
            "derivative_bound": self.tail.derivative_bound if self.tail else np.nan,
            "objective": self.solution.objective,
            "keeps_states": float(self.keeps_states),
            "keeps_rates": float(self.keeps_rates),
        }

    @property
    def explanation(self) -> str:
        """Say which test fails, and by how much."""
        if self.tail is None or self.growth_rates is None:
            zeta = decay_distance(self.solution.posterior.signals[0].kernel)
            return f"at k̄ = {self.k_bar} a sample still lies within ζ = {zeta:.4g} s of t̄, so bounds may still grow"
        low, high = self.growth_rates
        return (
            f"at k̄ = {self.k_bar} later states may reach {self.tail.states} "
            f"({'inside' if self.keeps_states else 'not inside'} the state set) and change at up to "
            f"±{self.tail.derivative_bound:.4g}/s ({'inside' if self.keeps_rates else 'not inside'} the growth rates "
            f"[{low:.4g}, {high:.4g}]/s)"
        )


Trace = Mapping[str, Array]
"""The iterations of Algorithm 1 as columns by the names of `Iteration.numbers`."""


@dataclass(frozen=True)
class Run:
    """All iterations, and the outcome: a Solution, NoSolution, or None if no iteration passed its tests."""

    iterations: tuple[Iteration, ...]
    outcome: Solution | NoSolution | None

    @property
    def trace(self) -> Trace:
        """The columns of the table whose rows are the `numbers` of the iterations."""
        rows = [iteration.numbers for iteration in self.iterations]
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}

    @property
    def explanation(self) -> str:
        """Say why there is no reference; an empty string if there is one."""
        if isinstance(self.outcome, NoSolution):
            done = f" after k̄ = {self.iterations[-1].k_bar}" if self.iterations else ""
            return f"no solution{done}: {self.outcome.explanation}"
        if self.outcome is None:
            return f"Algorithm 1 did not end: {self.iterations[-1].explanation}"
        return ""


def algorithm1(
    samples: tuple[Samples, ...],
    prior: JointPrior,
    plant: ConstrainedSystem,
    space: SearchSpace,
    reading: Reading,
    first_step: int,
    last_step: int,
) -> Run:
    """Run the loop from k̄ = `first_step` to `last_step` at most.

    Raises ValueError for systems that are not scalar.
    """
    iterations: list[Iteration] = []
    solution: Solution | None = None
    for k_bar in range(first_step, last_step + 1):
        problem = ConstrainedProblem(samples, prior, space, reading.constraints(plant, k_bar))
        outcome = tightened(solution, problem) if solution else best_solution(problem)
        if not isinstance(outcome, Solution):
            return Run(tuple(iterations), outcome)
        solution = outcome
        iterations.append(_test(plant, reading, k_bar, solution))
        done("fit")
        if iterations[-1].terminates:
            return Run(tuple(iterations), solution)
    return Run(tuple(iterations), None)


def tightened(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    """Solve a problem that has all constraints that `solution` satisfies, and further constraints.

    If the old minimiser satisfies the new constraints, it is the new minimiser.
    """
    old = Candidate.at(problem, solution.posterior.prior.log_hyperparameters)
    if old.with_overlooked(problem).is_feasible:
        return replace(solution, fits=0)
    return best_solution(problem, near=solution)


def _test(plant: ConstrainedSystem, reading: Reading, k_bar: int, solution: Solution) -> Iteration:
    posterior = solution.posterior
    bounds = tail(posterior.signals[0], k_bar * plant.sampling_time)
    if bounds is None:
        return Iteration(k_bar, solution, None, None, keeps_states=False, keeps_rates=False)
    rates = growth_rates(plant, reading.growth_states(bounds, posterior))
    return Iteration(k_bar, solution, bounds, rates, bounds.keeps_states(plant), bounds.keeps_rates(rates))
