"""The certified reference of an experiment, whatever its kind."""

from pipeline.certificates.certified import Certified, learn_certified
from pipeline.errors import NoReferenceError
from pipeline.experiments import Experiment
from pipeline.gp.samples import Samples
from pipeline.learning.learned import LearnedReference

CERTIFIED = "certified"


def certified(experiment: Experiment, samples: Samples) -> LearnedReference:
    """Learned with a proof for all real times. Raises NoReferenceError, saying what stands in its way."""
    plant = experiment.constrained_system
    found = learn_certified((samples,), experiment.learned_prior, plant, experiment.search_space(samples))
    if not isinstance(found, Certified):
        raise NoReferenceError(f"experiment {experiment.name}, {CERTIFIED}: {found.explanation}")
    return LearnedReference.of(CERTIFIED, found.solution, plant, fits=found.solution.fits)
