"""Stage 1: the samples, published or drawn."""

import numpy as np

from pipeline.archive import write_samples
from pipeline.errors import InputError
from pipeline.experiments import Experiment
from pipeline.experiments.fields import SampleDraw, SampleFile
from pipeline.gp.samples import Samples
from pipeline.ground_truth import GROUND_TRUTHS
from pipeline.learning.problem import ConstrainedProblem
from pipeline.results import Results
from pipeline.tables import column, read_columns


def generate(experiment: Experiment, results: Results) -> None:
    """Write the samples, and the ground truth at every verified step where it is known."""
    try:
        samples = _samples(experiment)
        if samples.times[0] < 0:
            raise ValueError(f"samples: times must not be negative (steps count from 0), got {samples.times[0]:g} s")
        # Raises where the samples are too few for what is to be learned from them.
        ConstrainedProblem((samples,), experiment.learned_prior, experiment.search_space(samples))
        experiment.check(samples)
    except ValueError as error:
        raise InputError(f"experiment {experiment.name}: {error}") from error
    truth = None
    if experiment.ground_truth:
        times = np.arange(experiment.verification.last_step + 1, dtype=float) * experiment.system.sampling_time
        truth = times, GROUND_TRUTHS[experiment.ground_truth](times)
    write_samples(results, samples, truth)


def _samples(experiment: Experiment) -> Samples:
    sampling_time = experiment.system.sampling_time
    match experiment.samples:
        case SampleFile() as source:
            return _read_csv(source, sampling_time)
        case SampleDraw() as draw:
            return experiment.drawn(draw, draw.seed)


def _read_csv(source: SampleFile, sampling_time: float) -> Samples:
    columns = read_columns(source.file)
    times, values = (column(source.file, columns, name) for name in (source.time_column, source.value_column))
    try:
        return Samples(times if source.time_unit == "seconds" else times * sampling_time, values)
    except ValueError as error:
        raise InputError(f"{source.file}: {error}") from error
