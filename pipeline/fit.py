"""Stage 2: samples → references (unconstrained, as published, sound, certified), and the iterations on the way."""

import numpy as np
from tqdm import tqdm

from pipeline.archive import Fitted, read_samples, write_fit
from pipeline.certificates.certified import Certified, learn_certified
from pipeline.errors import NoReferenceError
from pipeline.experiments import Experiment
from pipeline.files import write_text
from pipeline.gp.samples import Samples
from pipeline.learning.algorithm1 import AS_PUBLISHED, SOUND, Reading, Run, algorithm1
from pipeline.learning.exchange import solve
from pipeline.learning.learned import LearnedReference, Trace
from pipeline.learning.problem import ConstrainedProblem, Solution
from pipeline.results import Results

READINGS = (AS_PUBLISHED, SOUND)
_INSTANTS_PER_STEP = 2
_TABLE = ("k_bar", "mean_bound", "growth_lower", "growth_upper", "derivative_bound")


def fit(experiment: Experiment, results: Results) -> None:
    """Learn the references. Raises NoReferenceError, before anything is written, where one cannot be had."""
    samples = read_samples(results)
    learned, traces = [_unconstrained(experiment, samples)], {}
    for reading in READINGS:
        run = _run(experiment, samples, reading)
        traces[reading.name] = Trace.of(run.iterations)
        learned.append(_outcome(experiment, reading, run))
    learned.append(_certified(experiment, samples))
    steps = np.arange(_INSTANTS_PER_STEP * experiment.verification.last_step + 1) / _INSTANTS_PER_STEP
    fitted = Fitted(samples, {reference.method: reference for reference in learned}, traces)
    write_fit(results, fitted, steps * experiment.system.sampling_time)
    write_text(results.iterations, _csv(traces[AS_PUBLISHED.name]))


def _unconstrained(experiment: Experiment, samples: Samples) -> LearnedReference:
    problem = ConstrainedProblem(samples, experiment.learned_prior, experiment.search_space(samples))
    solution = solve(problem)
    if not isinstance(solution, Solution):
        raise NoReferenceError(f"experiment {experiment.name}, unconstrained: {solution.explanation}")
    return LearnedReference.of("unconstrained", solution, experiment.constrained_system)


def _run(experiment: Experiment, samples: Samples, reading: Reading) -> Run:
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


def _outcome(experiment: Experiment, reading: Reading, run: Run) -> LearnedReference:
    if not isinstance(run.outcome, Solution):
        raise NoReferenceError(f"experiment {experiment.name}, {reading.name}: {run.explanation}")
    return LearnedReference.of(reading.name, run.outcome, experiment.constrained_system, run.final_step)


def _certified(experiment: Experiment, samples: Samples) -> LearnedReference:
    plant = experiment.constrained_system
    found = learn_certified(samples, experiment.learned_prior, plant, experiment.search_space(samples))
    if not isinstance(found, Certified):
        raise NoReferenceError(f"experiment {experiment.name}, certified: {found.explanation}")
    return LearnedReference.of("certified", found.solution, plant)


def _csv(trace: Trace) -> str:
    """The trace as a table: numbers as the shortest text that reads back the same, nothing where there is no bound."""
    wanted = {*trace.hyperparameters, *_TABLE}
    columns = {name: values for name, values in trace.columns().items() if name in wanted}
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(map(_cell, row)) for row in rows)]) + "\n"


def _cell(value: float) -> str:
    return "" if np.isnan(value) else str(int(value)) if value == int(value) else repr(float(value))
