"""Both examples as the proofs need them: unconstrained, and as learned with a proof."""

from functools import cache

import numpy as np

from pipeline.published.scalar import scalar
from tests.pipeline.published import example1
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.goal import for_all_times
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference


def _periodic_samples() -> Samples:
    times = np.linspace(0, 4, 21)
    clean = np.sin(2 * times) + 0.5 * np.sin(4 * times + 1)
    return Samples(times, clean + 0.3 * np.random.default_rng(4).standard_normal(times.size))


SAMPLES = _periodic_samples()
PRIOR = JointPrior((Prior(Periodic(period=(2.5, 4.0)), noise_std=0.1),))
PLANT = scalar(0.9, 0.1, state_set=Interval(-2.0, 2.0), input_set=Interval(-3.0, 1.4), sampling_time=0.01)
SPACE = SearchSpace.around((SAMPLES,), PRIOR)

PROBLEMS = {
    "example1": ((example1.SAMPLES,), example1.PRIOR, example1.SYSTEM, example1.SPACE),
    "example2": ((SAMPLES,), PRIOR, PLANT, SPACE),
}


@cache
def certified(example: str) -> Certified:
    samples, prior, plant, space = PROBLEMS[example]
    problem = ConstrainedProblem(samples, prior, space)
    found = learn_certified(problem, plant, for_all_times(samples, prior, plant))
    assert isinstance(found, Certified), found.explanation
    return found


@cache
def unconstrained(example: str) -> Reference:
    samples, prior, plant, space = PROBLEMS[example]
    return Reference(best_solution(ConstrainedProblem(samples, prior, space)).posterior.signals, plant)
