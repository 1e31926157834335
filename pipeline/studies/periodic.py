"""What is learned about the periodic methods: how conservative program (8) is, and how much depends on the samples."""

import numpy as np

from pipeline.experiments import Experiment
from pipeline.experiments.sources import Drawn
from pipeline.methods.periodic import at_all_phases, on_intervals
from pipeline.published.ground_truth import GROUND_TRUTHS, draw
from trackably.arrays import Array
from trackably.errors import NoReferenceError
from trackably.gp.joint import JointPosterior
from trackably.gp.period import period_of
from trackably.gp.samples import Samples
from trackably.learning.methods import all_phases, unconstrained
from trackably.learning.problem import NoSolution, Solution
from trackably.systems.constrained import ConstrainedSystem


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
