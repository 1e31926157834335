"""The constrained learning problem, its solution, and what is said when there is none."""

from dataclasses import dataclass, field

import numpy as np

from pipeline.arrays import Array
from pipeline.gp.posterior import Posterior
from pipeline.gp.prior import Prior
from pipeline.gp.samples import Samples
from pipeline.learning.index_set import IndexSet
from pipeline.learning.space import SearchSpace
from pipeline.systems.quantity import Quantity

# Bounds are drawn in by this part of their width, so that rounding in the optimiser cannot leave them.
ROUNDING_BACKOFF = 1e-9


@dataclass(frozen=True)
class Constraint:
    """A quantity that has to stay inside its bounds, drawn in by `backoff` (a part of their width), on an index set."""

    quantity: Quantity
    index_set: IndexSet
    backoff: float = ROUNDING_BACKOFF

    def relative_margin(self, posterior: Posterior, t: Array) -> Array:
        """Distance to the nearer bound as a part of the bounds' width: negative where broken, 1/2 at the centre."""
        bounds = self.quantity.bounds
        return bounds.margin(self.quantity(posterior.mean, t)) / bounds.width

    def slack(self, posterior: Posterior, t: Array) -> Array:
        """Relative distances to the lower and to the upper bound, back-off deducted, of t with shape (n,): (2n,)."""
        bounds, value = self.quantity.bounds, self.quantity(posterior.mean, t)
        return np.concatenate([value - bounds.lower, bounds.upper - value]) / bounds.width - self.backoff

    def slack_jacobian(self, posterior: Posterior, t: Array) -> Array:
        """∂slack/∂ln θ, shape (2n, p)."""
        gradient = self.quantity.combine(posterior.mean_gradient, t).T / self.quantity.bounds.width
        return np.concatenate([gradient, -gradient])


@dataclass(frozen=True)
class ConstrainedProblem:
    """minimise l(θ) over the `space` of the prior's learned hyperparameters, subject to `constraints` on m⁺(·|θ).

    Raises ValueError for fewer samples than learned hyperparameters.
    """

    samples: Samples
    prior: Prior
    space: SearchSpace
    constraints: tuple[Constraint, ...] = field(default=())

    def __post_init__(self) -> None:
        if len(self.samples) < len(self.prior.learned):
            raise ValueError(
                f"samples: at least as many samples as learned hyperparameters are needed, got {len(self.samples)} "
                f"for {len(self.prior.learned)} ({', '.join(self.prior.learned)})"
            )

    def posterior(self, log_theta: Array) -> Posterior:
        return Posterior(self.prior.with_log_hyperparameters(log_theta), self.samples)


@dataclass(frozen=True)
class Solution:
    """Learned hyperparameters that satisfy every constraint on its whole index set.

    `log_theta` is the minimiser, `objective` is l there, `active` holds the times [s] of each constraint that took part
    in the program, `fits` counts the nonlinear programs that were solved.
    """

    posterior: Posterior
    objective: float
    active: tuple[Array, ...]
    fits: int


@dataclass(frozen=True)
class Infeasible:
    """No point of the search space was found that satisfies the constraints; `best` came closest.

    It breaks `quantity` at `time` [s] by `violation` (in the quantity's unit). `broken_at_rest` are the quantities that
    the prior mean itself, held for ever, does not keep strictly inside their bounds: with none, fading signals are
    feasible, and only the search space can stand in the way.
    """

    best: Posterior
    quantity: Quantity
    time: float
    violation: float
    broken_at_rest: tuple[Quantity, ...]

    @property
    def explanation(self) -> str:
        theta = ", ".join(f"{name} = {value:.4g}" for name, value in self.best.prior.hyperparameters.items())
        mean = self.best.prior.mean
        rest = "".join(
            f"the prior mean {mean:g} is no admissible equilibrium (its {q.name} {q.at_rest(mean):.4g} does not lie "
            f"inside {q.bounds}), so that nothing guarantees that the problem is feasible: choose another; "
            for q in self.broken_at_rest[:1]
        )
        return (
            f"{rest}no reference was found that keeps its bounds: the best attempt ({theta}) breaks the "
            f"{self.quantity.name} bounds {self.quantity.bounds} at t = {self.time:.6g} s by {self.violation:.3g}"
        )
