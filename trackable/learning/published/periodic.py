"""What a periodic reference is asked for: as the paper asks, in two ways, and exactly.

A problem here is a set of constraints; all of them are solved by the same search (`learn`), from the same starts.
"""

from collections.abc import Sequence

import numpy as np

from trackable.gp.joint import JointPrior
from trackable.gp.kernels.base import Kernel
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.samples import Samples
from trackable.learning.basins import Found, best_of
from trackable.learning.index_set import AllPhases, Steps, Window
from trackable.learning.problem import ROUNDING_BACKOFF, Bounded, ConstrainedProblem, Constraint
from trackable.learning.published.growth import GrowthRates
from trackable.learning.published.scalar import Scalar
from trackable.learning.screening import screened
from trackable.learning.space import SearchSpace
from trackable.systems.constrained import ConstrainedSystem

Constraints = tuple[Bounded, ...]
_WHOLE = 1e-9


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


def exact(plant: ConstrainedSystem, backoff: float = ROUNDING_BACKOFF) -> Constraints:
    """The input form at all phases: x_r(t) ∈ X and u_r(t) ∈ U for every real t, whatever the period becomes."""
    return tuple(Constraint(quantity, AllPhases(period_of), backoff) for quantity in plant.quantities)


def grid(plant: Scalar, last_step: int) -> Constraints:
    """Problem (6) of the paper with k̄ = `last_step` ≥ T_p/T_s: sampled instants only.

    Its closing remark prefers this to (9). Where the period is no multiple of T_s it proves nothing for k > k̄.
    """
    t_s = plant.sampling_time
    states, inputs = Steps(0, last_step, t_s), Steps(0, last_step - 1, t_s)
    return Constraint(plant.state, states), Constraint(plant.input, inputs)


def intervals(plant: Scalar, last_step: int, count: int, backoff: float = ROUNDING_BACKOFF) -> Constraints:
    """Program (9) of the paper on [0, k̄ T_s] with η = `count` intervals and k̄ = `last_step` ≥ T_p/T_s."""
    end = last_step * plant.sampling_time
    edges = tuple(np.linspace(0.0, end, count + 1).tolist())
    return Constraint(plant.state, Window(0.0, end), backoff), GrowthRates(plant, edges, backoff)


def sampled(plant: Scalar, period: float) -> Constraints:
    """For a known period n T_s: the n instants of one period are all that ever occur, so that they suffice for all k.

    Raises ValueError where the period is no whole multiple of T_s.
    """
    t_s = plant.sampling_time
    steps = round(period / t_s)
    if steps < 1 or abs(period / t_s - steps) > _WHOLE * steps:
        raise ValueError(f"the period {period!r} s is no whole multiple of the sampling time {t_s!r} s")
    once = Steps(0, steps - 1, t_s)
    return Constraint(plant.state, once), Constraint(plant.input, once)


def starts(
    samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem, space: SearchSpace
) -> list[np.ndarray]:
    """Where to start from, for every way to constrain the same samples."""
    return screened(ConstrainedProblem(samples, prior, space, exact(plant)), space.starts)


def learn(
    samples: tuple[Samples, ...],
    prior: JointPrior,
    plant: ConstrainedSystem,
    space: SearchSpace,
    constraints: Constraints,
) -> Found:
    """The best reference that keeps the constraints. TypeError for a kernel without a period."""
    period_of([part.kernel for part in prior.parts])
    problem = ConstrainedProblem(samples, prior, space, constraints)
    # Without constraints the amplitude is free: the bounds of the plant would only mislead.
    first = screened(problem, space.starts) if not constraints else starts(samples, prior, plant, space)
    return best_of(problem, first)
