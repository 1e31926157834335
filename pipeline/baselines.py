"""What the paper's methods are compared with: the likelihood alone, and constraints at all phases."""

from trackably.checker.certificate import AllPhases
from trackably.gp.joint import JointPrior, period_of
from trackably.gp.samples import Samples
from trackably.learning.constraint import ROUNDING_BACKOFF, Constraint
from trackably.learning.index_set import RealTimes
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem


def learn_unconstrained(
    samples: tuple[Samples, ...],
    prior: JointPrior,
    plant: ConstrainedSystem,
    space: SearchSpace,
) -> Solution | NoSolution:
    """Maximise the marginal likelihood and nothing else: the usual Gaussian process regression."""
    return best_solution(ConstrainedProblem(samples, prior, space))


def exact(
    samples: tuple[Samples, ...],
    prior: JointPrior,
    plant: ConstrainedSystem,
    space: SearchSpace,
    backoff: float = ROUNDING_BACKOFF,
) -> Solution | NoSolution:
    """Constrain a periodic reference at all phases, so that x_r(t) ∈ X and u_r(t) ∈ U for every real t.

    Raises TypeError for kernels without a common period.
    """
    period_of([part.kernel for part in prior.parts])  # raises for kernels without one
    return best_solution(ConstrainedProblem(samples, prior, space, all_phases(plant, backoff)))


def all_phases(plant: ConstrainedSystem, backoff: float = ROUNDING_BACKOFF) -> tuple[Constraint, ...]:
    """Constrain every bounded quantity at all phases of the learned period."""
    return tuple(Constraint(quantity, RealTimes(AllPhases()), backoff) for quantity in plant.quantities)
