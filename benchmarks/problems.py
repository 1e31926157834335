"""The problems that are timed, in the words of the library."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from benchmarks.machine import ROOT
from pipeline.experiments import load_experiment
from pipeline.generate import sampled_by
from pipeline.published.scalar import state_and_input
from trackably.arrays import Array
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import Steps
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem

NOISE = 0.1


def wave(times: Array) -> Samples:
    """A noisy sine."""
    noise = NOISE * np.random.default_rng(len(times)).standard_normal(len(times))
    return Samples(times, np.sin(times) + noise)


def irregular(n: int) -> Samples:
    """Ten samples a second, at random times."""
    return wave(np.sort(np.random.default_rng(n).uniform(0, n / 10, n)))


def regular(n: int, step: float = 0.1) -> Samples:
    """A sample every `step` seconds."""
    return wave(step * np.arange(n))


PRIOR = JointPrior((Prior(SquaredExponential(1.0, 0.7).as_learned(), NOISE),))


_LOG_THETA = PRIOR.log_hyperparameters


def likelihood(samples: Samples) -> tuple[float, Array]:
    """l and its gradient, as an optimiser asks for them: at ln θ."""
    return JointPosterior(PRIOR.with_log_hyperparameters(_LOG_THETA), (samples,)).negative_log_marginal_likelihood()


def free(samples: Samples, starts: int = 1) -> ConstrainedProblem:
    """The unconstrained problem."""
    return ConstrainedProblem((samples,), PRIOR, SearchSpace.around((samples,), PRIOR, starts=starts))


@dataclass(frozen=True)
class Example:
    """One of the paper's examples, with its committed samples."""

    samples: Samples
    prior: JointPrior
    system: ConstrainedSystem
    space: SearchSpace
    last_step: int

    def on_steps(self, last: int) -> ConstrainedProblem:
        """States up to step `last`, and the inputs that lead there: problem (4) of the paper."""
        return self.at_instants(last, self.system.sampling_time)

    def at_instants(self, count: int, spacing: float) -> ConstrainedProblem:
        """State and input at `count` instants [s]."""
        state, entry = state_and_input(self.system)
        constraints = Constraint(state, Steps(0, count, spacing)), Constraint(entry, Steps(0, count - 1, spacing))
        return ConstrainedProblem((self.samples,), self.prior, self.space, constraints)


@cache
def example(name: str) -> Example:
    """As params.yaml has it."""
    experiment = load_experiment(name, ROOT / "params.yaml")
    (samples,) = sampled_by(experiment).samples
    space = experiment.search_space((samples,))
    return Example(samples, experiment.learned_prior, experiment.plant, space, experiment.verification.last_step)
