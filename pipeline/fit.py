"""Stage 2: samples → references, each learned by one of the experiment's methods, and a table of iterations."""

import warnings
from collections.abc import Mapping

import numpy as np

from pipeline.environment import environment
from pipeline.experiments import Experiment
from pipeline.experiments.model import with_learned_means
from pipeline.methods import JOINT, UNCONSTRAINED, Fit, Task
from pipeline.storage.archive import Fitted, read_samples, write_fit
from pipeline.storage.results import ENVIRONMENT, Results, to_csv
from trackably.arrays import Array
from trackably.errors import NoReferenceError
from trackably.files import write_json, write_text
from trackably.progress import progress_bar
from trackably.reference.explanation import IgnoresSamplesWarning, ignores_samples
from trackably.reference.fit import Fit as TrackableFit
from trackably.systems.reference import Reference

_INSTANTS_PER_STEP = 2
_INTERVALS = 1000  # most intervals of a logged curve: a viewer shows no more, and logged references give other points


def fit(experiment: Experiment, results: Results) -> None:
    """Learn the references. Raises NoReferenceError, before anything is written, if a method finds none."""
    sampled = read_samples(results)
    experiment = with_learned_means(experiment, sampled.samples)
    fits = _fits(experiment, experiment.task(sampled.samples))
    _ask(experiment, fits)
    learned = {name: found.learned(name, experiment.plant_of(name)) for name, found in fits.items()}
    traces = {name: found.trace for name, found in fits.items() if found.trace}
    last = experiment.verified(sampled.samples).last_step
    steps = np.linspace(0, last, min(_INSTANTS_PER_STEP * last, _INTERVALS) + 1)
    write_fit(results, Fitted(sampled, learned, traces), steps * experiment.plant.sampling_time)
    write_text(results.iterations, to_csv(_iterations(fits)))
    write_json(results.folder / ENVIRONMENT, environment())


def _fits(experiment: Experiment, task: Task) -> dict[str, Fit]:
    """Return the fit of each method by its name. Raises NoReferenceError if a method finds none."""
    fits: dict[str, Fit] = {}
    for method in experiment.learned_by:
        with progress_bar(f"{experiment.name}: fit {method.name}"):
            found = method.learn(task)
        if not isinstance(found, Fit):
            raise NoReferenceError(f"experiment {experiment.name}, {method.name}: {found.explanation}")
        fits[method.name] = found
    return fits


def _ask(experiment: Experiment, fits: Mapping[str, Fit]) -> None:
    """Warn as `learn_reference` does if the joint fit ignores its samples."""
    found, free = fits[JOINT.name].solution, fits[UNCONSTRAINED.name].solution.posterior
    of = TrackableFit.of(Reference(found.signals, experiment.plant), found, free, ())
    if sentence := ignores_samples(of):
        warnings.warn(f"experiment {experiment.name}: {sentence}", IgnoresSamplesWarning, stacklevel=3)


def _iterations(fits: Mapping[str, Fit]) -> Mapping[str, Array]:
    """Return the iterations of the first method that has some."""
    return next((found.iterations for found in fits.values() if found.iterations), {})
