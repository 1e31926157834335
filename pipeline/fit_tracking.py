"""References of systems with several states and inputs: unconstrained, and certified."""

import numpy as np
from tqdm import tqdm

from pipeline.experiments import TrackingExperiment
from pipeline.fit_certified import CERTIFIED, certified
from pipeline.storage.archive import Fitted
from pipeline.storage.sampled import Sampled
from trackable.arrays import Array
from trackable.certificates.certified import Round
from trackable.errors import NoReferenceError
from trackable.learning.learned import LearnedReference
from trackable.learning.methods import unconstrained
from trackable.learning.problem import Solution

UNCONSTRAINED = "unconstrained"


def learn(experiment: TrackingExperiment, sampled: Sampled) -> tuple[Fitted, dict[str, Array]]:
    """The references, and the rounds of fit and proof. Raises NoReferenceError."""
    rounds: list[Round] = []
    with tqdm(desc=f"{experiment.name}: fit", unit="fit", disable=None) as bar:
        free = _unconstrained(experiment, sampled)
        bar.update()

        def on_round(done: Round) -> None:
            rounds.append(done)
            bar.update()

        proved = certified(experiment, sampled.samples, on_round)
    table = {
        "round": np.arange(1.0, len(rounds) + 1),
        "backoff": np.array([done.backoff for done in rounds]),
        "objective": np.array([done.objective for done in rounds]),
        "proved": np.array([float(done.proved) for done in rounds]),
    }
    return Fitted(sampled, {UNCONSTRAINED: free, CERTIFIED: proved}, {}), table


def _unconstrained(experiment: TrackingExperiment, sampled: Sampled) -> LearnedReference:
    plant, space = experiment.constrained_system, experiment.search_space(sampled.samples)
    outcome = unconstrained(sampled.samples, experiment.learned_prior, plant, space)
    if not isinstance(outcome, Solution):
        raise NoReferenceError(f"experiment {experiment.name}, {UNCONSTRAINED}: {outcome.explanation}")
    return LearnedReference.of(UNCONSTRAINED, outcome, plant)
