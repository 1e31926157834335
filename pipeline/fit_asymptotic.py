"""Asymptotically constant references: unconstrained, Algorithm 1 in two readings, certified."""

from tqdm import tqdm

from pipeline.experiments import AsymptoticExperiment
from pipeline.fit_certified import certified
from pipeline.storage.archive import Fitted
from pipeline.storage.sampled import Sampled
from trackable.arrays import Array
from trackable.errors import NoReferenceError
from trackable.gp.samples import Samples
from trackable.learning.learned import LearnedReference, Trace
from trackable.learning.methods import unconstrained
from trackable.learning.problem import Solution
from trackable.learning.published.algorithm1 import AS_PUBLISHED, SOUND, Reading, Run, algorithm1

READINGS = (AS_PUBLISHED, SOUND)
_TABLE = ("k_bar", "mean_bound", "growth_lower", "growth_upper", "derivative_bound")


def learn(experiment: AsymptoticExperiment, sampled: Sampled) -> tuple[Fitted, dict[str, Array]]:
    """The references, and the iterations of Algorithm 1 as published. Raises NoReferenceError."""
    samples = sampled.samples
    learned, traces = [_unconstrained(experiment, samples)], {}
    for reading in READINGS:
        run = _run(experiment, samples, reading)
        traces[reading.name] = Trace.of(run.iterations)
        learned.append(_outcome(experiment, reading, run))
    learned.append(certified(experiment, samples))
    trace = traces[AS_PUBLISHED.name]
    table = {name: values for name, values in trace.columns().items() if name in {*trace.hyperparameters, *_TABLE}}
    return Fitted(sampled, {reference.method: reference for reference in learned}, traces), table


def _unconstrained(experiment: AsymptoticExperiment, samples: tuple[Samples, ...]) -> LearnedReference:
    plant, space = experiment.constrained_system, experiment.search_space(samples)
    solution = unconstrained(samples, experiment.learned_prior, plant, space)
    if not isinstance(solution, Solution):
        raise NoReferenceError(f"experiment {experiment.name}, unconstrained: {solution.explanation}")
    return LearnedReference.of("unconstrained", solution, plant)


def _run(experiment: AsymptoticExperiment, samples: tuple[Samples, ...], reading: Reading) -> Run:
    first, last = experiment.algorithm1.first_step, experiment.algorithm1.last_step
    with tqdm(total=last - first + 1, desc=f"{experiment.name}: {reading.name}", unit="fit", disable=None) as bar:
        return algorithm1(
            samples,
            experiment.learned_prior,
            experiment.constrained_system,
            experiment.search_space(samples),
            reading,
            first,
            last,
            on_iteration=lambda k_bar: bar.update(),
        )


def _outcome(experiment: AsymptoticExperiment, reading: Reading, run: Run) -> LearnedReference:
    if not isinstance(run.outcome, Solution):
        raise NoReferenceError(f"experiment {experiment.name}, {reading.name}: {run.explanation}")
    return LearnedReference.of(reading.name, run.outcome, experiment.constrained_system, final_step=run.final_step)
