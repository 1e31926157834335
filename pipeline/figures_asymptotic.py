"""Figures of an asymptotically constant reference."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from pipeline.experiments import AsymptoticExperiment
from pipeline.published.ground_truth import GROUND_TRUTHS
from pipeline.storage.archive import Fitted, read_fit, read_margins
from pipeline.storage.results import Results
from pipeline.storage.tables import read_columns
from trackable import plots
from trackable.gp.joint import JointPrior
from trackable.learning.landscape import Landscape, landscape
from trackable.learning.problem import ConstrainedProblem
from trackable.learning.published.algorithm1 import AS_PUBLISHED, SOUND
from trackable.learning.published.scalar import interval_sets
from trackable.learning.space import SearchSpace

_STEPS_OF_TUBE = 12
_GRID_POINTS = 56
# The landscape spans these factors around the learned hyperparameters: all around, and near by.
_OVERVIEW, _CLOSER = 8.0, 1.25


def drawings(experiment: AsymptoticExperiment, results: Results) -> dict[str, Callable[[], Figure]]:
    """The figures of an experiment by name, each drawn when it is called: here and in the notebook the same."""
    fitted = read_fit(results)
    sound = fitted.learned[SOUND.name]
    plant, final_step = experiment.constrained_system, sound.final_step or 0
    references = {name: learned.reference for name, learned in fitted.learned.items()}
    last_sample = round(float(fitted.sampled.only.times[-1]) / plant.sampling_time)
    by_name: dict[str, Callable[[], Figure]] = {
        "tube": lambda: plots.tube(references[SOUND.name], np.arange(_STEPS_OF_TUBE, dtype=float)),
        "asymptotic": lambda: plots.asymptotic(
            references[SOUND.name], fitted.sampled.only, last_sample, final_step, round(1.5 * final_step)
        ),
        "convergence": lambda: plots.convergence(
            fitted.traces[AS_PUBLISHED.name], interval_sets(plant)[0], sound.prior.parts[0].mean
        ),
        "prediction": lambda: _prediction(experiment, fitted),
        "margins": lambda: plots.margins(read_margins(results, fitted.learned)),
    }
    if len(sound.prior.parts[0].kernel.hyperparameters.keys() & sound.prior.learned) == 2:
        by_name["landscape"] = lambda: plots.landscape(
            landscapes(experiment, fitted), fitted.traces[SOUND.name], references
        )
    return by_name


def landscapes(experiment: AsymptoticExperiment, fitted: Fitted) -> Sequence[Landscape]:
    """The likelihood and the constraints of the sound reading's last iteration, around what was learned."""
    learned = fitted.learned[SOUND.name]
    (own,) = learned.prior.parts
    kernel = [name for name in own.kernel.hyperparameters if name in own.learned]
    # Where the noise is learned too, the landscape is cut at its learned value.
    prior = replace(own, fixed=frozenset(own.hyperparameters.keys() - set(kernel)))
    space = experiment.search_space(fitted.sampled.samples)
    problem = ConstrainedProblem(
        fitted.sampled.samples,
        JointPrior((prior,)),
        SearchSpace({name: bounds for name, bounds in space.bounds.items() if name in kernel}),
        SOUND.constraints(experiment.constrained_system, learned.final_step or 0),
    )
    first, second = (prior.hyperparameters[name] for name in kernel)
    grids = []
    for factor in (_OVERVIEW, _CLOSER):
        spread = np.geomspace(1 / factor, factor, _GRID_POINTS)
        grids.append(landscape(problem, first * spread, second * spread))
    return grids


def _prediction(experiment: AsymptoticExperiment, fitted: Fitted) -> Figure:
    final_step = fitted.learned[SOUND.name].final_step or 0
    steps = np.arange(round(1.5 * final_step) + 1, dtype=float)
    truth = GROUND_TRUTHS.get(experiment.ground_truth or "")
    return plots.prediction(
        fitted.sampled.only,
        {name: learned.reference for name, learned in fitted.learned.items()},
        SOUND.name,
        steps,
        true_reference=truth(steps * experiment.system.sampling_time) if truth else None,
        published=_published(experiment),
        final_step=final_step,
    )


def _published(experiment: AsymptoticExperiment) -> plots.Published | None:
    if experiment.published_prediction is None:
        return None
    columns = read_columns(experiment.published_prediction)
    names = ("k", "mean_unconstrained", "mean_constrained", "successor_lower", "successor_upper")
    return plots.Published(**{name: columns[name] for name in names})
