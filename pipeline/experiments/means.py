"""Prior means that an experiment leaves to be learned: as they are most likely, given the samples."""

import warnings

from pipeline.experiments.fields import PriorFields
from pipeline.experiments.model import Experiment
from trackably.beforehand import Beforehand, learned_beforehand, levels
from trackably.errors import DoubtfulInputWarning, NoReferenceError
from trackably.gp.samples import Samples


def with_learned_means(experiment: Experiment, samples: tuple[Samples, ...]) -> Experiment:
    """Return the experiment with known prior means: those that were intervals are learned from the samples.

    Raises NoReferenceError where the likelihood of the samples cannot be evaluated.
    """
    between = {
        name: fields.mean
        for name, fields in experiment.prior.items()
        if isinstance(fields, PriorFields) and isinstance(fields.mean, tuple)
    }
    if not between:
        return experiment
    prior = experiment.learned_prior
    ends = levels(between, prior.names, samples)
    found = learned_beforehand(samples, prior, ends, experiment.search.starts, keep=False)
    if not isinstance(found, Beforehand):
        raise NoReferenceError(f"experiment {experiment.name}: prior.mean: {found.explanation}")
    for question in found.questions:
        warnings.warn(f"experiment {experiment.name}: {question}", DoubtfulInputWarning, stacklevel=2)
    named = zip(prior.names, found.prior.parts, samples, strict=True)
    learned = {name: float(of.of_level.stencil.at_rest(part.mean)) for name, part, of in named if name in between}
    known = {name: {"mean": learned[name]} if name in learned else {} for name in experiment.prior}
    return experiment.model_copy(
        update={"prior": {name: of.model_copy(update=known[name]) for name, of in experiment.prior.items()}}
    )
