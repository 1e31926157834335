"""Methods on many problems: other numbers of intervals, other draws of the samples, tighter bounds."""

import multiprocessing
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import fields
from functools import partial
from itertools import product
from typing import TypeVar

import numpy as np
from tqdm import tqdm

from pipeline.experiments import Experiment
from pipeline.experiments.sources import Drawn
from pipeline.methods import HYPERPARAMETERS, JOINT, METHODS, Failed, at_all_phases, on_intervals
from pipeline.published.ground_truth import GROUND_TRUTHS, draw
from pipeline.storage.archive import Conservatism, Draws, Study, Tightness
from trackably.arrays import Array
from trackably.errors import NoReferenceError
from trackably.gp.joint import JointPosterior, period_of
from trackably.gp.samples import Samples
from trackably.learning.methods import all_phases, unconstrained
from trackably.learning.problem import NoSolution, Solution
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference

Row = TypeVar("Row")
Task = tuple[Callable[..., Row], Iterable[Iterable[object]]]


@contextmanager
def mapped(*tasks: Task[Row]) -> Iterator[list[Iterator[Row]]]:
    """Give the results of each function for its iterables of arguments, as `map` does, computed on all cores.

    A terminal interrupts all processes of a command. These ignore it, from their first line on, so that none of them
    prints where it was; the first process ends them.
    """
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        try:
            with _ignored_interrupts():
                results = [pool.map(function, *arguments) for function, arguments in tasks]
            yield results
        except KeyboardInterrupt:
            for process in multiprocessing.active_children():
                process.terminate()
            raise


@contextmanager
def _ignored_interrupts() -> Iterator[None]:
    """Ignore interrupts for a moment, and in the processes that begin in it for good."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def interval_row(experiment: Experiment, samples: tuple[Samples, ...], count: int) -> list[float]:
    """Return the entries of `Conservatism` for η = `count`; an empty row where (8) has no solution."""
    task = experiment.task(samples)
    outcome = on_intervals(task, count)
    if not isinstance(outcome, Solution):
        return []
    return [count, outcome.objective, *_margins(task.plant, outcome.posterior)]


def draw_row(experiment: Experiment, seed: int) -> list[float]:
    """Return the entries of `Draws` for one seed."""
    task = experiment.task((_drawn(experiment, seed),))
    free = _solution(experiment, seed, unconstrained(task.samples, task.prior, task.plant, task.space))
    margins = _margins(task.plant, free.posterior)
    kept = _solution(experiment, seed, at_all_phases(task)) if min(margins) < 0 else free
    steps = np.arange(experiment.verified(task.samples).last_step + 1, dtype=float)
    times, (truth,) = steps * task.plant.sampling_time, experiment.truths.values()
    of_free, of_kept = (_summary(solution, times, truth(times)) for solution in (free, kept))
    return [float(seed), *of_free, *margins, *of_kept]


def _drawn(experiment: Experiment, seed: int) -> Samples:
    """Return the experiment's samples as another seed gives them."""
    (source,) = experiment.sources.values()
    assert isinstance(source, Drawn), "the experiment was checked for this"
    times = source.steps.times(experiment.plant.sampling_time)
    return draw(GROUND_TRUTHS[source.ground_truth], times, source.noise_std, seed)


def _solution(experiment: Experiment, seed: int, outcome: Solution | NoSolution) -> Solution:
    if not isinstance(outcome, Solution):
        raise NoReferenceError(f"experiment {experiment.name}, seed {seed}: {outcome.explanation}")
    return outcome


def _summary(solution: Solution, times: Array, truth: Array) -> list[float]:
    """Return l, the period, and the root mean square distance to the ground truth at the verified times."""
    (signal,) = solution.posterior.signals
    off = signal(times) - truth
    return [solution.objective, period_of([signal.kernel]), float(np.sqrt(np.mean(off**2)))]


def _margins(plant: ConstrainedSystem, posterior: JointPosterior) -> list[float]:
    """Return the smallest margins of state and input over all phases."""
    return [float(np.min(c.closest(posterior)[1])) * c.quantity.bounds.width for c in all_phases(plant)]


def tightness_row(experiment: Experiment, samples: tuple[Samples, ...], method: str, upper: float) -> list[float]:
    """Return the entries of `Tightness` for one upper bound of the state; an empty row where nothing was proved."""
    task = experiment.with_upper_bound(upper).task(samples)
    found = METHODS[method].learn(task)
    if isinstance(found, Failed):
        return []
    reference = Reference(found.solution.signals, task.plant)
    (signal,), (of,), (truth,) = reference.signals, samples, experiment.truths.values()
    times = reference.instants(np.arange(experiment.verified(samples).last_step + 1, dtype=float))
    misfit = of.mean_square(of.values - of.stencil.measured(signal, of.times))
    error = np.mean((reference.state_at(times)[:, 0] - truth(times)) ** 2)
    return [upper, found.solution.objective, float(np.sqrt(misfit)), float(np.sqrt(error))]


_PROVED = (HYPERPARAMETERS.name, JOINT.name)


def study(experiment: Experiment, samples: tuple[Samples, ...]) -> Study | None:
    """Run the studies of the experiment; return None where it has none. Raises NoReferenceError.

    The numbers do not depend on how many cores there are: each process has one BLAS thread, as its environment says.
    """
    wanted = experiment.study
    if wanted is None:
        return None
    tighter = [*product(_PROVED, wanted.tightness)]
    with mapped(
        (partial(interval_row, experiment, samples), [wanted.conservatism]),
        (partial(draw_row, experiment), [range(wanted.draws)]),
        (partial(tightness_row, experiment, samples), [*zip(*tighter, strict=True)]),
    ) as (intervals, draws, bounds):
        of_counts = [row for row in tqdm(intervals, total=len(wanted.conservatism), desc="η", disable=None) if row]
        of_seeds = list(tqdm(draws, total=wanted.draws, desc="draws", disable=None))
        of_bounds = list(tqdm(bounds, total=len(tighter), desc="bounds", disable=None))
    by_method = {
        name: [row for (method, _), row in zip(tighter, of_bounds, strict=True) if method == name and row]
        for name in _PROVED
        if wanted.tightness
    }
    return Study(
        Conservatism(*_columns(Conservatism, of_counts)),
        Draws(*_columns(Draws, of_seeds)),
        {name: Tightness(*_columns(Tightness, rows)) for name, rows in by_method.items()},
    )


def _columns(table: type[Conservatism | Draws | Tightness], rows: Sequence[Sequence[float]]) -> list[Array]:
    return list(np.array(rows, dtype=float).reshape(len(rows), len(fields(table))).T)
