"""Periodic references as the paper learns them: on the grid of problem (4), and by program (8)."""

import numpy as np

from trackably.gp.joint import JointPrior
from trackably.gp.period import period_of
from trackably.gp.samples import Samples
from trackably.learning.constraint import ROUNDING_BACKOFF, Bounded, Constraint
from trackably.learning.index_set import Steps, Window
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackably.learning.published.growth import GrowthRates
from trackably.learning.published.scalar import state_and_input
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem

_WHOLE = 1e-9


def grid(
    samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem, space: SearchSpace, last_step: int
) -> Solution | NoSolution:
    """Solve problem (4) of the paper with k̄ = `last_step` ≥ T_p/T_s: constraints at sampled instants only.

    The paper's closing remark prefers this to (8). If the period is no multiple of T_s, nothing is proved for k > k̄.
    Raises TypeError for kernels without a period and ValueError for systems that are not scalar.
    """
    return _learned(samples, prior, space, on_grid(plant, last_step))


def intervals(
    samples: tuple[Samples, ...],
    prior: JointPrior,
    plant: ConstrainedSystem,
    space: SearchSpace,
    last_step: int,
    count: int,
    backoff: float = ROUNDING_BACKOFF,
) -> Solution | NoSolution:
    """Solve program (8) of the paper on [0, k̄ T_s] with η = `count` intervals and k̄ = `last_step` ≥ T_p/T_s.

    As printed it does not cover steps from one interval into the next. That is harmless for 0 ≤ a ≤ 1 only; see
    `sound_intervals`. Raises TypeError for kernels without a period and ValueError for systems that are not scalar.
    """
    return _learned(samples, prior, space, _on_intervals(plant, last_step, count, backoff, overlap=0.0))


def sound_intervals(
    samples: tuple[Samples, ...],
    prior: JointPrior,
    plant: ConstrainedSystem,
    space: SearchSpace,
    last_step: int,
    count: int,
    backoff: float = ROUNDING_BACKOFF,
) -> Solution | NoSolution:
    """Solve program (8) with growth rates that hold one T_s beyond each interval: arguments and errors as `intervals`.

    This closes the gap of the paper's Lemma 2 for every a: each step is within the rates of the interval in which it
    begins.
    """
    return _learned(samples, prior, space, _on_intervals(plant, last_step, count, backoff, plant.sampling_time))


def sampled(
    samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem, space: SearchSpace
) -> Solution | NoSolution:
    """Constrain the n instants of one period, for a known period n T_s: the values repeat, so this suffices for all k.

    Raises ValueError if the period is learned or no whole multiple of T_s, and for systems that are not scalar. Raises
    TypeError for kernels without a period.
    """
    once = Steps(0, steps_of_period(prior, plant) - 1, plant.sampling_time)
    return _learned(samples, prior, space, tuple(Constraint(q, once) for q in state_and_input(plant)))


def on_grid(plant: ConstrainedSystem, last_step: int) -> tuple[Constraint, Constraint]:
    """Return constraints on the state at steps 0 … k̄ and on the input at the steps before k̄ = `last_step`."""
    state, input_ = state_and_input(plant)
    states, inputs = Steps(0, last_step, plant.sampling_time), Steps(0, last_step - 1, plant.sampling_time)
    return Constraint(state, states), Constraint(input_, inputs)


def _on_intervals(
    plant: ConstrainedSystem, last_step: int, count: int, backoff: float, overlap: float
) -> tuple[Constraint, GrowthRates]:
    end = last_step * plant.sampling_time
    edges = tuple(np.linspace(0.0, end, count + 1).tolist())
    state, _ = state_and_input(plant)
    return Constraint(state, Window(0.0, end), backoff), GrowthRates(plant, edges, backoff, overlap)


def steps_of_period(prior: JointPrior, plant: ConstrainedSystem) -> int:
    """Return n for a known period n T_s. Raises ValueError and TypeError as `sampled`."""
    if any(name.endswith("period") for name in prior.learned):
        raise ValueError("the period is learned, so that no finite set of instants is all that ever occurs")
    period, sampling_time = period_of([part.kernel for part in prior.parts]), plant.sampling_time
    steps = round(period / sampling_time)
    if steps < 1 or abs(period / sampling_time - steps) > _WHOLE * steps:
        raise ValueError(f"the period {period!r} s is no whole multiple of the sampling time {sampling_time!r} s")
    return steps


def _learned(
    samples: tuple[Samples, ...], prior: JointPrior, space: SearchSpace, constraints: tuple[Bounded, ...]
) -> Solution | NoSolution:
    period_of([part.kernel for part in prior.parts])  # raises for kernels without one
    return best_solution(ConstrainedProblem(samples, prior, space, constraints))
