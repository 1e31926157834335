"""Stage 2: samples → references, each learned by one of the experiment's methods, and a table of iterations.

A study does the same on many problems: other numbers of intervals, other draws of the samples, tighter bounds.
"""

import signal
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from itertools import chain, islice
from typing import TypeVar

import numpy as np
from joblib import Parallel, delayed
from tqdm import tqdm

from pipeline.environment import environment
from pipeline.experiments import Experiment
from pipeline.experiments.model import with_learned_means
from pipeline.experiments.sources import Drawn
from pipeline.methods import (
    HYPERPARAMETERS,
    JOINT,
    METHODS,
    UNCONSTRAINED,
    Fit,
    Task,
    at_all_phases,
    best,
    in_intervals,
)
from pipeline.published.periodic import all_phases
from pipeline.storage.archive import Conservatism, Draws, Fitted, Study, Tightness, read_samples, write_fit
from pipeline.storage.results import ENVIRONMENT, Results, to_csv
from trackably.arrays import Array, root_mean_square
from trackably.errors import NoReferenceError
from trackably.files import write_json, write_text
from trackably.gp.joint import JointPosterior, period_of
from trackably.gp.samples import Samples
from trackably.learning.constraint import closest
from trackably.learning.problem import NoSolution, Solution
from trackably.progress import progress_bar
from trackably.reference.explanation import IgnoresSamplesWarning, ignores_samples
from trackably.reference.fit import Fit as TrackableFit
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference

Table = TypeVar("Table", Conservatism, Draws, Tightness)


def in_processes(calls: Iterable[object]) -> Iterator[list[float]]:
    """Yield the results of joblib's `delayed` calls in their order, computed on all cores.

    If Ctrl-C is pressed, a terminal interrupts all processes of a command. Worker processes ignore the interrupt, so
    that they print no tracebacks; the first process ends them.
    """
    ignored = {"initializer": signal.signal, "initargs": (signal.SIGINT, signal.SIG_IGN)}
    found: Iterator[list[float]] = Parallel(n_jobs=-1, backend="loky", return_as="generator", **ignored)(calls)
    return found


def interval_row(experiment: Experiment, samples: tuple[Samples, ...], count: int) -> list[float]:
    """Return the entries of `Conservatism` for η = `count` intervals; an empty list if program (8) has no solution."""
    task = experiment.task(samples)
    outcome = best(task, in_intervals(task, count))
    if not isinstance(outcome, Solution):
        return []
    return [count, outcome.objective, *_margins(task.plant, outcome.posterior)]


def draw_row(experiment: Experiment, seed: int) -> list[float]:
    """Return the entries of `Draws` for one seed."""
    task = experiment.task((_drawn(experiment, seed),))
    free = _solution(experiment, seed, best(task))
    margins = _margins(task.plant, free.posterior)
    kept = _solution(experiment, seed, best(task, at_all_phases(task))) if min(margins) < 0 else free
    times, (truth,) = experiment.verified_times(task.samples), experiment.truths.values()
    of_free, of_kept = (_summary(solution, times, truth(times)) for solution in (free, kept))
    return [float(seed), *of_free, *margins, *of_kept]


def _drawn(experiment: Experiment, seed: int) -> Samples:
    """Return samples as the experiment draws them, with another seed."""
    (source,), (truth,) = experiment.sources.values(), experiment.truths.values()
    assert isinstance(source, Drawn), "the experiment was checked for this"
    return source.model_copy(update={"seed": seed}).samples(truth, experiment.plant.sampling_time)


def _solution(experiment: Experiment, seed: int, outcome: Solution | NoSolution) -> Solution:
    if not isinstance(outcome, Solution):
        raise NoReferenceError(f"experiment {experiment.name}, seed {seed}: {outcome.explanation}")
    return outcome


def _summary(solution: Solution, times: Array, truth: Array) -> list[float]:
    """Return l, the period, and the root mean square distance to the ground truth at the verified times."""
    (signal,) = solution.posterior.signals
    return [solution.objective, period_of([signal.kernel]), root_mean_square(signal(times) - truth)]


def _margins(plant: ConstrainedSystem, posterior: JointPosterior) -> list[float]:
    """Return the smallest margins of state and input over all phases."""
    return [float(np.min(closest([c], posterior)[0][1])) * c.quantity.bounds.width for c in all_phases(plant)]


def tightness_row(experiment: Experiment, samples: tuple[Samples, ...], method: str, upper: float) -> list[float]:
    """Return the entries of `Tightness` for one upper bound of the state; an empty list if no reference was proved."""
    task = experiment.with_upper_bound(upper).task(samples)
    found = METHODS[method].learn(task)
    if not isinstance(found, Fit):
        return []
    reference = Reference(found.solution.signals, task.plant)
    (signal,), (of,), (truth,) = reference.signals, samples, experiment.truths.values()
    times = experiment.verified_times(samples)
    misfit = of.mean_square(of.values - of.stencil.measured(signal, of.times))
    error = root_mean_square(reference.state_at(times)[:, 0] - truth(times))
    return [upper, found.solution.objective, float(np.sqrt(misfit)), error]


_PROVED = (HYPERPARAMETERS.name, JOINT.name)


def study(experiment: Experiment, samples: tuple[Samples, ...]) -> Study | None:
    """Run the studies of the experiment; return None if it has none. Raises NoReferenceError.

    The numbers do not depend on how many cores there are: each process has one BLAS thread, as its environment says.
    """
    wanted = experiment.study
    if wanted is None:
        return None
    proved = _PROVED if wanted.tightness else ()
    tasks = (
        [delayed(interval_row)(experiment, samples, count) for count in wanted.conservatism],
        [delayed(draw_row)(experiment, seed) for seed in range(wanted.draws)],
        *([delayed(tightness_row)(experiment, samples, name, upper) for upper in wanted.tightness] for name in proved),
    )
    every = [*chain.from_iterable(tasks)]
    rows = iter([*tqdm(in_processes(every), total=len(every), desc=f"{experiment.name}: study", disable=None)])
    counts, draws, *bounds = [[row for row in islice(rows, len(of)) if row] for of in tasks]
    tighter = (_table(Tightness, rows) for rows in bounds)
    return Study(_table(Conservatism, counts), _table(Draws, draws), dict(zip(proved, tighter, strict=True)))


def _table(of: type[Table], rows: Sequence[Sequence[float]]) -> Table:
    """Return the columns of a study from its rows."""
    return of(*np.array(rows, dtype=float).reshape(len(rows), len(fields(of))).T)


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
    fitted = Fitted(sampled, learned, traces, study(experiment, sampled.samples))
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
