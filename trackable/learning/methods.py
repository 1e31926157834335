"""Methods beside the paper's own, called alike: (samples, prior, plant, space, …) → Solution or NoSolution."""

from collections.abc import Sequence

from trackable.gp.joint import JointPrior
from trackable.gp.kernels.base import Kernel
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.samples import Samples
from trackable.learning.constraint import ROUNDING_BACKOFF, Constraint
from trackable.learning.index_set import AllPhases
from trackable.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackable.learning.search import best_solution
from trackable.learning.space import SearchSpace
from trackable.systems.constrained import ConstrainedSystem


def unconstrained(
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
    """Everything that is bounded, at every phase of the period, whatever the period becomes."""
    return tuple(Constraint(quantity, AllPhases(period_of), backoff) for quantity in plant.quantities)


def period_of(kernels: Sequence[Kernel]) -> float:
    """The period [s] of some signals' kernels. TypeError where there is none: what happens in one stretch of time then
    says nothing of the others, and no finite set of constraints gives a guarantee for all times."""
    periods = set()
    for kernel in kernels:
        if not isinstance(kernel, Periodic):
            raise TypeError(
                f"a guarantee for all times from one period needs a periodic kernel, got {type(kernel).__name__}"
            )
        periods.add(kernel.period)
    if len(periods) != 1:
        raise TypeError(f"a guarantee for all times from one period needs one for all signals, got {sorted(periods)}")
    return periods.pop()
