"""The certified reference of an experiment, whatever its kind."""

from collections.abc import Callable

from pipeline.experiments import Experiment
from trackable.certificates.certified import Certified, Round, learn_certified
from trackable.errors import NoReferenceError
from trackable.gp.samples import Samples
from trackable.learning.learned import LearnedReference

CERTIFIED = "certified"


def certified(
    experiment: Experiment, samples: tuple[Samples, ...], on_round: Callable[[Round], object] = lambda done: None
) -> LearnedReference:
    """Learned with a proof of the experiment's goal. Raises NoReferenceError, saying what stands in its way."""
    plant = experiment.constrained_system
    space, goal = experiment.search_space(samples), experiment.goal(samples)
    found = learn_certified(samples, experiment.learned_prior, plant, space, goal, on_round)
    if not isinstance(found, Certified):
        raise NoReferenceError(f"experiment {experiment.name}, {CERTIFIED}: {found.explanation}")
    return LearnedReference.of(CERTIFIED, found.solution, plant, fits=found.solution.fits)
