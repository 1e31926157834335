"""Problems of certified learning, as the benchmarks of both learners take them, and what was learned."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.machine import ROOT
from pipeline.experiments import load_experiment
from pipeline.generate import sampled_by
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.goal import Claim, goal_for
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.learning.learner import Learner
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope


@dataclass(frozen=True)
class Task:
    """What a learner of certified references is given."""

    samples: tuple[Samples, ...]
    prior: JointPrior
    plant: ConstrainedSystem
    claim: Claim
    starts: int = 8

    def learned(self, learner: Learner) -> Certified:
        """Return the reference with its proof; a benchmark without one is stopped."""
        goal = goal_for(self.claim, self.samples, self.prior, self.plant)
        space = SearchSpace.around(self.samples, self.prior, self.starts)
        found = learn_certified(self.samples, self.prior, self.plant, space, goal, learner=learner)
        assert isinstance(found, Certified), found.explanation
        return found

    def with_known(self, prior: JointPrior) -> "Task":
        """Return the same task with the hyperparameters of a prior, all known."""
        return replace(self, prior=prior.as_known())

    def with_upper_state_bound(self, bound: float) -> "Task":
        """Return the same task of a scalar system with another upper bound of its state."""
        lower = [
            quantity.bounds.lower for quantity in self.plant.quantities if quantity.name in self.plant.system.states
        ]
        return replace(self, plant=replace(self.plant, state_set=Polytope.box(lower, [bound])))


def task(name: str) -> Task:
    """Return the experiment of this name in params.yaml."""
    experiment = load_experiment(name, ROOT / "params.yaml")
    samples, search = sampled_by(experiment).samples, experiment.search
    return Task(samples, experiment.learned_prior, experiment.plant, experiment.claim, search.starts)


def held_out(name: str) -> Samples:
    """Return the samples that the experiment of this name holds out."""
    (found,) = sampled_by(load_experiment(name, ROOT / "params.yaml")).held_out_by_name.values()
    return found


def misfit(found: Certified, samples: tuple[Samples, ...]) -> float:
    """Return the root mean square of what the samples see of the reference, minus the samples, of all processes."""
    signals = found.solution.signals
    pairs = zip(samples, signals, strict=True)
    beside = [of.stencil.measured(signal, of.times) - of.values for of, signal in pairs]
    return float(np.sqrt(np.mean(np.concatenate(beside) ** 2)))
