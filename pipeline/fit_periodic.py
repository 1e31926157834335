"""Periodic references: unconstrained, on the paper's grid, by its program (9), and exactly; and how they compare."""

import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import fields
from functools import partial
from multiprocessing import get_context

import numpy as np
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from pipeline.experiments import PeriodicExperiment
from pipeline.experiments.fields import SampleDraw
from pipeline.fit_certified import CERTIFIED, certified
from pipeline.published.ground_truth import GROUND_TRUTHS
from pipeline.storage.archive import Fitted
from pipeline.storage.sampled import Sampled
from trackable.arrays import Array
from trackable.errors import NoReferenceError
from trackable.gp.joint import JointPosterior
from trackable.gp.samples import Samples
from trackable.learning.learned import LearnedReference
from trackable.learning.methods import all_phases, exact, period_of, unconstrained
from trackable.learning.problem import NoSolution, Solution
from trackable.learning.published.periodic import grid, intervals, steps_of_period
from trackable.learning.published.periodic import sampled as on_sampled_instants
from trackable.learning.study import Conservatism, Draws, Study

Method = Callable[..., Solution | NoSolution]

UNCONSTRAINED, GRID, INTERVALS, EXACT, SAMPLED = "unconstrained", "grid", "intervals", "exact", "sampled"


def learn(experiment: PeriodicExperiment, sampled: Sampled) -> tuple[Fitted, dict[str, Array], dict[str, float]]:
    """References by method, the rounds of the exact form's exchange, and seconds by method. Raises NoReferenceError."""
    plant, samples = experiment.constrained_system, sampled.samples
    learned: dict[str, LearnedReference] = {}
    seconds: dict[str, float] = {}
    rounds: dict[str, Array] = {}
    for method, learned_by in tqdm(_methods(experiment).items(), desc=f"{experiment.name}: fit", disable=None):
        begin = time.perf_counter()
        found = _found(experiment, samples, learned_by)
        seconds[method] = round(time.perf_counter() - begin, 3)
        if not isinstance(found, Solution):
            raise NoReferenceError(f"experiment {experiment.name}, {method}: {found.explanation}")
        learned[method] = LearnedReference.of(method, found, plant, fits=found.fits)
        if method == EXACT:
            rounds = _rounds(experiment, found)
    begin = time.perf_counter()
    learned[CERTIFIED] = certified(experiment, samples)
    seconds[CERTIFIED] = round(time.perf_counter() - begin, 3)
    return Fitted(sampled, learned, {}, _study(experiment, samples)), rounds, seconds


def _methods(experiment: PeriodicExperiment) -> dict[str, Method]:
    wanted = experiment.periodic
    methods: dict[str, Method] = {
        UNCONSTRAINED: unconstrained,
        GRID: partial(grid, last_step=wanted.last_step),
        INTERVALS: partial(intervals, last_step=wanted.last_step, count=wanted.intervals, backoff=wanted.backoff),
        EXACT: partial(exact, backoff=wanted.backoff),
    }
    with suppress(ValueError):  # where instants fall dense in the period, `exact` is what there is
        steps_of_period(experiment.learned_prior, experiment.constrained_system)
        methods[SAMPLED] = on_sampled_instants
    return methods


def _found(experiment: PeriodicExperiment, samples: tuple[Samples, ...], method: Method) -> Solution | NoSolution:
    plant, space = experiment.constrained_system, experiment.search_space(samples)
    return method(samples, experiment.learned_prior, plant, space)


def _rounds(experiment: PeriodicExperiment, found: Solution) -> dict[str, Array]:
    log_theta = np.array([r.log_theta for r in found.rounds]).reshape(len(found.rounds), -1)
    return {
        "round": np.arange(1.0, len(found.rounds) + 1),
        **dict(zip(experiment.learned_prior.learned, np.exp(log_theta).T, strict=False)),
        "objective": np.array([r.objective for r in found.rounds]),
        "relative_margin": np.array([r.margin for r in found.rounds]),
        "places": np.array([float(r.places) for r in found.rounds]),
    }


def _study(experiment: PeriodicExperiment, samples: tuple[Samples, ...]) -> Study:
    """The heavy part, spread over the machine's cores: the numbers do not depend on how."""
    wanted = experiment.periodic
    with ProcessPoolExecutor(mp_context=get_context("spawn"), initializer=_one_thread) as pool:
        rows = pool.map(partial(_interval_row, experiment, samples), wanted.conservatism)
        draws = pool.map(partial(_draw_row, experiment), range(wanted.draws))
        of_counts = [row for row in tqdm(rows, total=len(wanted.conservatism), desc="η", disable=None) if row]
        of_seeds = list(tqdm(draws, total=wanted.draws, desc="draws", disable=None))
    return Study(Conservatism(*_columns(Conservatism, of_counts)), Draws(*_columns(Draws, of_seeds)))


def _one_thread() -> None:
    """For a new process, once this module has loaded all that brings threads: the same bits whatever the machine."""
    threadpool_limits(limits=1)


def _columns(table: type[Conservatism] | type[Draws], rows: list[list[float]]) -> list[Array]:
    return list(np.array(rows, dtype=float).reshape(len(rows), len(fields(table))).T)


def _interval_row(experiment: PeriodicExperiment, samples: tuple[Samples, ...], count: int) -> list[float]:
    """The entries of `Conservatism` for η = `count`; empty where (9) has no solution."""
    wanted = experiment.periodic
    outcome = _found(
        experiment, samples, partial(intervals, last_step=wanted.last_step, count=count, backoff=wanted.backoff)
    )
    if not isinstance(outcome, Solution):
        return []
    return [count, outcome.objective, *_margins(experiment, outcome.posterior)]


def _draw_row(experiment: PeriodicExperiment, seed: int) -> list[float]:
    """The entries of `Draws` for one seed."""
    assert isinstance(experiment.samples, SampleDraw)
    samples = (experiment.drawn(experiment.samples, seed),)
    free = _found(experiment, samples, unconstrained)
    if not isinstance(free, Solution):
        raise NoReferenceError(f"experiment {experiment.name}, seed {seed}: {free.explanation}")
    margins, kept = _margins(experiment, free.posterior), free
    if min(margins) < 0:
        outcome = _found(experiment, samples, partial(exact, backoff=experiment.periodic.backoff))
        if not isinstance(outcome, Solution):
            raise NoReferenceError(f"experiment {experiment.name}, seed {seed}: {outcome.explanation}")
        kept = outcome
    return [float(seed), *_summary(experiment, free), *margins, *_summary(experiment, kept)]


def _summary(experiment: PeriodicExperiment, solution: Solution) -> list[float]:
    """l, the period, and the root mean square distance to the true reference at the verified steps."""
    times = np.arange(experiment.verification.last_step + 1, dtype=float) * experiment.system.sampling_time
    off = solution.posterior.signals[0](times) - GROUND_TRUTHS[experiment.ground_truth or ""](times)
    period = period_of([solution.posterior.signals[0].kernel])
    return [solution.objective, period, float(np.sqrt(np.mean(off**2)))]


def _margins(experiment: PeriodicExperiment, posterior: JointPosterior) -> list[float]:
    """The smallest margins of state and input over all phases."""
    constraints = all_phases(experiment.constrained_system)
    return [float(np.min(c.closest(posterior)[1])) * c.quantity.bounds.width for c in constraints]
