"""Stage 2: samples → references, each learned by one of the experiment's methods, and the iterations on the way."""

import time
import warnings
from collections.abc import Mapping

import numpy as np

from pipeline.environment import environment
from pipeline.experiments import Experiment
from pipeline.experiments.model import with_learned_means
from pipeline.methods import JOINT, UNCONSTRAINED, Fit, LearnedReference, Method, Task
from pipeline.storage.archive import Fitted, read_samples, write_fit
from pipeline.storage.results import Results
from pipeline.storage.tables import to_csv
from pipeline.studies import study
from trackably.arrays import Array
from trackably.errors import DoubtfulInputWarning, NoReferenceError
from trackably.explanation import IgnoresSamplesWarning, ignored, outlying
from trackably.files import write_json, write_text
from trackably.fit import Fit as TrackableFit
from trackably.progress.bar import progress_bar
from trackably.systems.reference import Reference

_INSTANTS_PER_STEP = 2
_INTERVALS = 1000  # of a curve: a viewer shows no more, and every instant can be computed from what is logged


def fit(experiment: Experiment, results: Results) -> None:
    """Learn the references. Raises NoReferenceError, before anything is written, where a method finds none."""
    sampled = read_samples(results)
    experiment = with_learned_means(experiment, sampled.samples)
    fits, seconds = _fits(experiment, experiment.task(sampled.samples))
    _ask(experiment, fits)
    learned = {
        name: LearnedReference.of(
            name, found.solution, experiment.plant_of(name), final_step=found.final_step, fits=found.fits
        )
        for name, found in fits.items()
    }
    traces = {name: found.trace for name, found in fits.items() if found.trace}
    last = experiment.verified(sampled.samples).last_step
    steps = np.linspace(0, last, min(_INSTANTS_PER_STEP * last, _INTERVALS) + 1)
    fitted = Fitted(sampled, learned, traces, study(experiment, sampled.samples))
    write_fit(results, fitted, steps * experiment.plant.sampling_time)
    write_text(results.iterations, to_csv(_iterations(fits)))
    write_json(results.environment, environment())
    write_json(results.timings, seconds)


def _fits(experiment: Experiment, task: Task) -> tuple[dict[str, Fit], dict[str, float]]:
    """Return what each method found, and how long it took [s]."""
    fits: dict[str, Fit] = {}
    seconds: dict[str, float] = {}
    for method in experiment.learned_by:
        begin = time.perf_counter()
        with progress_bar(f"{experiment.name}: fit {method.name}"):
            fits[method.name] = _fit(experiment.name, method, task)
        seconds[method.name] = round(time.perf_counter() - begin, 3)
    return fits, seconds


def _fit(experiment: str, method: Method, task: Task) -> Fit:
    found = method.learn(task)
    if not isinstance(found, Fit):
        raise NoReferenceError(f"experiment {experiment}, {method.name}: {found.explanation}")
    return found


def _ask(experiment: Experiment, fits: Mapping[str, Fit]) -> None:
    """Warn as `learn_reference` does: where the joint fit ignores samples, and of outliers among those that are all.

    Where fewer centres stand for many samples, none of these is known here.
    """
    found, free = fits[JOINT.name].solution, fits[UNCONSTRAINED.name].solution.posterior
    of = TrackableFit.of(Reference(found.signals, experiment.plant), found, free, ())
    if sentence := ignored(of):
        warnings.warn(f"experiment {experiment.name}: {sentence}", IgnoresSamplesWarning, stacklevel=3)
    if question := outlying(misfit for misfit in of.misfits if not misfit.samples.scatter.count):
        warnings.warn(f"experiment {experiment.name}: {question}", DoubtfulInputWarning, stacklevel=3)


def _iterations(fits: Mapping[str, Fit]) -> Mapping[str, Array]:
    """Return the iterations of the first method that has some."""
    return next((found.iterations for found in fits.values() if found.iterations), {})
