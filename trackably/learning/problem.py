"""The constrained learning problem, its solution, and the explanation where there is none."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.posterior import IllConditioned
from trackably.gp.prior import NOISE
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum
from trackably.learning.constraint import Constraint
from trackably.learning.space import SearchSpace
from trackably.systems.trajectories import Quantity, Trajectory
from trackably.work import done

MANY_CONTACTS = 100  # with more active bounds, small violations are left to a larger back-off (tightening of bounds)
# J = l + D may exceed its least value by LEAST_GAP, or by _RELATIVE_GAP times the price D, whichever is larger.
LEAST_GAP, _RELATIVE_GAP = 0.01, 1e-3


def gap_allowed(price: float) -> float:
    """Return the amount by which J may exceed the least J for the same hyperparameters, if bounds cost D = `price`."""
    return max(LEAST_GAP, _RELATIVE_GAP * price)


@dataclass(frozen=True)
class RequiredValue:
    """A required value: the quantity `name` equals `value` at `time` [s], up to `tolerance` (in its unit)."""

    name: str
    trajectory: Trajectory
    time: float
    value: float
    tolerance: float


@dataclass(frozen=True)
class ConstrainedProblem:
    """Minimise l(θ) = −2 ln p(y|θ) over the `space` of learned hyperparameters, under `constraints` on posterior means.

    There is one set of samples for each process of the prior. Without constraints, prior means may be learned too:
    `means` has an interval for each learned mean and None for each known one, and each learned mean is the most likely
    one for θ. With `bases`, prior means are these functions, and all hyperparameters are known. ValueError: there are
    fewer samples than learned hyperparameters.
    """

    samples: tuple[Samples, ...]
    prior: JointPrior
    space: SearchSpace
    constraints: tuple[Constraint, ...] = field(default=())
    required: tuple[RequiredValue, ...] = field(default=())
    means: tuple[tuple[float, float] | None, ...] = field(default=())
    bases: tuple[KernelSum, ...] = field(default=())

    def __post_init__(self) -> None:
        count = sum(len(samples) for samples in self.samples)
        if count < len(self.prior.learned):
            raise ValueError(
                f"samples: expected at least as many samples as learned hyperparameters, got {count} "
                f"for {len(self.prior.learned)} ({', '.join(self.prior.learned)}); give numbers for some of these"
            )

    @property
    def broken_at_rest(self) -> tuple[Quantity, ...]:
        """The quantities that leave or touch their bounds when all signals rest at the prior mean."""
        means = [part.mean for part in self.prior.parts]
        quantities = [constraint.quantity for constraint in self.constraints]
        return tuple(q for q in quantities if not q.is_kept_at_rest(means))

    def posterior(self, log_theta: Array) -> JointPosterior:
        done("evaluation")
        found = JointPosterior(self.prior.with_log_hyperparameters(log_theta), self.samples, self.bases)
        return found.with_likeliest_means(self.means) if self.means else found

    def nlml(self, log_theta: Array) -> float:
        """Return l(θ); infinity if K + σ_n² I cannot be factored."""
        try:
            return self.posterior(log_theta).negative_log_marginal_likelihood()[0]
        except IllConditioned:
            return np.inf


@dataclass(frozen=True)
class Round:
    """One program of the exchange method: its minimiser ln θ, the objective l, and the smallest relative margin there.

    `places` is the number of times at which the program imposes bounds, summed over all constraints.
    """

    log_theta: Array
    objective: float
    margin: float
    places: int


Side = Literal["lower", "upper", "equal"]

Method = Literal["joint", "hyperparameters"]
"""What was learned: function and hyperparameters together, or the hyperparameters alone."""


@dataclass(frozen=True)
class ActiveBound:
    """A bound that is active at one `time` [s]; it costs `price`, in the unit of l.

    `name` is that of the quantity, and `side` is "lower", "upper", or "equal" for a required value. To first order, the
    objective J = l + D changes by twice the `multiplier` λ for each unit by which the bound moves. The prices of all
    active bounds sum up to D, the cost of the bounds.
    """

    name: str
    side: Side
    time: float
    multiplier: float
    price: float


@dataclass(frozen=True)
class Solution:
    """Learned hyperparameters and signals that satisfy every constraint on its whole index set.

    `objective` is J = l + D, where D = `price` is the cost of the `active_bounds`. Without active bounds, the `signals`
    are the posterior means, and J = l. `active` has, for each constraint, the times at which the last program imposed
    it. `fits` counts the nonlinear programs solved, and `rounds` are those that led from a start to this solution.
    `others` are the ln θ of other local minima, best first. `method` says what was learned. `unconstrained` is the
    posterior at the minimum of the likelihood, if the learner computed it. `missed` bounds the violation, relative to a
    bound's width, that is left if a program would need bounds at too many times; a larger back-off (tightening of the
    bounds) removes it. `alone` is the least J found of a posterior mean that keeps the bounds, or infinite. `spread`
    is the range of J among functions found from several starts for the same hyperparameters; functions may differ if
    bounded quantities are nonlinear in the signals. In that case, the search tightened bounds by up to `backoff`, a
    part of their width, more than the problem demands.
    """

    posterior: JointPosterior
    signals: tuple[KernelSum, ...]
    objective: float
    active: tuple[Array, ...]
    fits: int
    rounds: tuple[Round, ...] = ()
    active_bounds: tuple[ActiveBound, ...] = ()
    others: tuple[Array, ...] = ()
    method: Method = "hyperparameters"
    unconstrained: JointPosterior | None = None
    missed: float = 0.0
    alone: float = np.inf
    spread: float = 0.0
    backoff: float = 0.0

    @property
    def price(self) -> float:
        """D, the cost of the bounds for the learned hyperparameters."""
        return sum(bound.price for bound in self.active_bounds)

    @property
    def nlml(self) -> float:
        """l, the negative log marginal likelihood of the learned hyperparameters."""
        return self.objective - self.price

    @property
    def is_rough(self) -> bool:
        """Whether signals with kinks have so many active bounds, over 100, that a proof needs slack between them."""
        return len(self.active_bounds) > MANY_CONTACTS and not all(signal.kernel.is_analytic for signal in self.signals)

    @property
    def allowed_gap(self) -> float:
        """The amount by which the objective J = l + D may exceed its least value for these hyperparameters."""
        return gap_allowed(self.price)

    def rise(self, quantities: Iterable[Quantity]) -> float:
        """Return dJ/dε to first order if the bounds of these quantities move inwards by ε times their width."""
        widths = {quantity.name: quantity.bounds.width for quantity in quantities}
        return 2 * sum(abs(bound.multiplier) * widths.get(bound.name, 0.0) for bound in self.active_bounds)


class NoSolution(ABC):
    """The reason why there is no solution."""

    @property
    @abstractmethod
    def explanation(self) -> str:
        """One sentence for the user: why the problem has no solution, and what may help."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.explanation})"


@dataclass(frozen=True, repr=False)
class NothingFactored(NoSolution):
    """K + σ_n² I has no Cholesky factor in float64 at any point of the search, so feasibility could not be examined."""

    prior: JointPrior

    @property
    def explanation(self) -> str:
        noise = " or ".join(f"{v:.3g}" for name, v in self.prior.hyperparameters.items() if name.endswith(NOISE))
        return (
            f"K + σ_n² I is not positive definite in float64 at any point of the search: noise_std = "
            f"{noise} is too small for samples this close, or the search space too wide"
        )


@dataclass(frozen=True, repr=False)
class OutOfTime(NoSolution):
    """The `budget` [s] ended before anything was proved; `so_far` says why earlier attempts failed, if any did."""

    budget: float
    so_far: str = ""

    @property
    def explanation(self) -> str:
        so_far = f". What was tried first failed: {self.so_far}" if self.so_far else ""
        return (
            f"the budget of {self.budget:g} s ended before a reference was proved: give more time, fewer `centres` or "
            "known hyperparameters; `learn_stream` is faster if samples last far longer than a kernel's memory"
            f"{so_far}"
        )


@dataclass(frozen=True, repr=False)
class UnmetBounds(NoSolution):
    """No function was found that meets all bounds and required values; `among` has the bounds with large multipliers.

    The multipliers are a dual ray, in float64, of the program at the hyperparameters of `posterior`. This ray is no
    proof: for other hyperparameters there may be a function that meets them all. `feasibility` looks for contradictions
    that hold for every function, and the checker verifies them.
    """

    posterior: JointPosterior
    among: tuple[ActiveBound, ...]

    @property
    def explanation(self) -> str:
        sides = {"lower": "lower bound", "upper": "upper bound", "equal": "given value"}
        said = "; ".join(f"{bound.name} ({sides[bound.side]}) at t = {bound.time:.6g} s" for bound in self.among)
        return (
            f"no function was found that satisfies all of these bounds and given values: {said}; this is no proof that "
            "there is none; try wider bounds, fewer or other given values, or other hyperparameters"
        )


@dataclass(frozen=True, repr=False)
class NoFunction(NoSolution):
    """No function with the given values could be computed from any start."""

    required: tuple[RequiredValue, ...]

    @property
    def explanation(self) -> str:
        given = "; ".join(f"{each.name} = {each.value:.6g} at t = {each.time:.6g} s" for each in self.required)
        having = f" that has the given values ({given})" if given else ""
        return (
            f"no function could be computed{having}: values may be too far apart for the plant, its formulas may not "
            "be defined near them, or covariances cannot be factored in float64; give fewer or other values, other "
            "times, or another prior"
        )


@dataclass(frozen=True, repr=False)
class NothingFeasible(NoSolution):
    """No point of the search space was found that satisfies the constraints; `best` came closest.

    `best` violates the bounds of `quantity` at `time` [s] by `violation` (in the unit of `quantity`). `broken_at_rest`
    are the quantities that leave or touch their bounds when all signals rest at the prior mean. If there are none,
    signals of small amplitude are feasible, and the search space is too small.
    """

    best: JointPosterior
    quantity: Quantity
    time: float
    violation: float
    broken_at_rest: tuple[Quantity, ...]

    @property
    def explanation(self) -> str:
        theta = ", ".join(f"{name} = {value:.4g}" for name, value in self.best.prior.hyperparameters.items())
        means = [part.mean for part in self.best.prior.parts]
        level = ", ".join(f"{mean:g}" for mean in means)
        rest = "".join(
            f"the prior mean {level} is no admissible equilibrium (its {q.name} "
            f"{q.bounds.rest.snapped(q.at_rest(means)):.4g} does not lie inside {q.bounds}), so that nothing "
            "guarantees that the problem is feasible; "
            for q in self.broken_at_rest[:1]
        )
        what = f"breaks the {self.quantity.name} bounds {self.quantity.bounds.at(self.time)} at t = {self.time:.6g} s"
        if not np.isfinite(self.violation):
            what = (
                f"has no {self.quantity.name} at t = {self.time:.6g} s, as its formula is not defined there: give "
                "bounds of states that keep arguments of roots and logarithms above zero, and divisors away from zero"
            )
        by = f" by {self.violation:.3g}" if np.isfinite(self.violation) else ""
        found = f"{rest}no reference was found that keeps its bounds: the best attempt ({theta}) {what}{by}"
        if self.broken_at_rest or not self.best.prior.learned:
            return found
        return f"{found}; wider bounds of hyperparameters, or more starts, may find one"
