"""Stage 2: samples → references, and the iterations on the way; what is learned depends on the kind of experiment."""

from collections.abc import Mapping

import numpy as np

from pipeline import fit_asymptotic, fit_periodic, fit_tracking
from pipeline.environment.record import environment
from pipeline.experiments import AsymptoticExperiment, Experiment, PeriodicExperiment, TrackingExperiment
from pipeline.storage.archive import Fitted, read_samples, write_fit
from pipeline.storage.results import Results
from pipeline.storage.sampled import Sampled
from pipeline.storage.tables import to_csv
from trackable.arrays import Array
from trackable.files import write_json, write_text

_INSTANTS_PER_STEP = 2


def fit(experiment: Experiment, results: Results) -> None:
    """Learn the references. Raises NoReferenceError, before anything is written, where one cannot be had."""
    fitted, iterations, seconds = _learned(experiment, read_samples(results))
    steps = np.arange(_INSTANTS_PER_STEP * experiment.last_step + 1) / _INSTANTS_PER_STEP
    write_fit(results, fitted, steps * experiment.constrained_system.sampling_time)
    write_text(results.iterations, to_csv(iterations))
    write_json(results.environment, environment())
    if seconds:
        write_json(results.timings, seconds)


def _learned(experiment: Experiment, sampled: Sampled) -> tuple[Fitted, Mapping[str, Array], Mapping[str, float]]:
    """References, iterations, and how long each method took [s] where that is a question."""
    match experiment:
        case AsymptoticExperiment():
            return *fit_asymptotic.learn(experiment, sampled), {}
        case PeriodicExperiment():
            return fit_periodic.learn(experiment, sampled)
        case TrackingExperiment():
            return *fit_tracking.learn(experiment, sampled), {}
    raise TypeError(f"no way to learn from a {type(experiment).__name__}")
