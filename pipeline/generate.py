"""Stage 1: the samples, published or drawn."""

import numpy as np

from pipeline.collect import collect
from pipeline.experiments import Experiment, ScalarExperiment, TrackingExperiment
from pipeline.experiments.fields import SampleDraw, SampleFile
from pipeline.experiments.model import STATE
from pipeline.storage.archive import write_samples
from pipeline.storage.results import Results
from pipeline.storage.sampled import Sampled
from pipeline.storage.tables import column, read_columns
from trackable.errors import InputError
from trackable.gp.samples import Samples
from trackable.learning.problem import ConstrainedProblem


def generate(experiment: Experiment, results: Results) -> None:
    """Write the samples, and the ground truth at every verified step where it is known."""
    try:
        sampled = sampled_by(experiment)
        for name, samples in sampled.by_name.items():
            if samples.times[0] < 0:
                raise ValueError(
                    f"samples: times must not be negative (steps count from 0), got {samples.times[0]:g} s of {name}"
                )
        # Raises where the samples are too few for what is to be learned from them.
        ConstrainedProblem(sampled.samples, experiment.learned_prior, experiment.search_space(sampled.samples))
        experiment.check(sampled.samples)
    except ValueError as error:
        raise InputError(f"experiment {experiment.name}: {error}") from error
    times = np.arange(experiment.last_step + 1, dtype=float) * experiment.constrained_system.sampling_time
    truths = {name: (times, truth(times)) for name, truth in experiment.truths.items()}
    write_samples(results, sampled, truths)


def sampled_by(experiment: Experiment) -> Sampled:
    """The samples of an experiment. Raises InputError and ValueError for sources that do not hold them."""
    match experiment:
        case TrackingExperiment():
            return collect(experiment)
        case ScalarExperiment(samples=SampleFile() as source):
            return Sampled((STATE,), (_read_csv(source, experiment.system.sampling_time),))
        case ScalarExperiment(samples=SampleDraw() as draw):
            return Sampled((STATE,), (experiment.drawn(draw, draw.seed),))
    raise TypeError(f"no samples of a {type(experiment).__name__}")


def _read_csv(source: SampleFile, sampling_time: float) -> Samples:
    columns = read_columns(source.file)
    times, values = (column(source.file, columns, name) for name in (source.time_column, source.value_column))
    try:
        return Samples(times if source.time_unit == "seconds" else times * sampling_time, values)
    except ValueError as error:
        raise InputError(f"{source.file}: {error}") from error
