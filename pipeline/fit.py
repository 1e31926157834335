"""Stage 2: samples → references, each learned by one of the experiment's methods, and a table of iterations.

Some references are also learned with other upper bounds of the state.
"""

import warnings
from collections.abc import Mapping

import numpy as np
from tqdm import tqdm

from pipeline.environment import environment
from pipeline.experiments import Experiment
from pipeline.experiments.model import with_learned_means
from pipeline.methods import (
    HYPERPARAMETERS,
    JOINT,
    METHODS,
    UNCONSTRAINED,
    Fit,
    Task,
)
from pipeline.storage.archive import Fitted, Sampled, read_samples, write_fit
from pipeline.storage.results import ENVIRONMENT, Results, to_csv
from pipeline.verify import errors_of
from trackably.arrays import Array
from trackably.errors import NoReferenceError
from trackably.files import write_json, write_text
from trackably.progress import progress_bar
from trackably.reference.explanation import IgnoresSamplesWarning, ignores_samples
from trackably.reference.fit import Fit as TrackableFit
from trackably.systems.reference import Reference

_PROVED = (HYPERPARAMETERS.name, JOINT.name)
_COLUMNS = ("uppers", "objectives", "misfits", "errors")


def tightness(experiment: Experiment, sampled: Sampled) -> dict[str, Mapping[str, Array]]:
    """Return by method, for each of other upper bounds of the state, J and two errors of its proved reference.

    These are the root mean square distances to the samples and to the true signal. Bounds for which no reference is
    proved are left out. The result is empty if the experiment names no bounds.
    """
    tried = [(method, upper) for method in _PROVED for upper in experiment.tightness]
    rows: dict[str, list[list[float]]] = {method: [] for method, _ in tried}
    for method, upper in tqdm(tried, desc=f"{experiment.name}: tightness", disable=None if tried else True):
        task = experiment.with_upper_bound(upper).task(sampled.samples)
        found = METHODS[method].learn(task)
        if isinstance(found, Fit):
            errors = errors_of(experiment, sampled, Reference(found.solution.signals, task.plant))
            rows[method].append([upper, found.solution.objective, errors["misfit"], errors["rmse"]])
    return {
        method: dict(zip(_COLUMNS, np.array(of).reshape(-1, len(_COLUMNS)).T, strict=True))
        for method, of in rows.items()
    }


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
    fitted = Fitted(sampled, learned, traces, tightness(experiment, sampled))
    write_fit(results, fitted, steps * experiment.plant.sampling_time)
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
