"""Figures of what Algorithm 1 learned."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from pipeline.experiments import Experiment
from pipeline.methods import AS_PUBLISHED, HYPERPARAMETERS, JOINT, SOUND, methods_in_figures
from pipeline.storage.archive import Fitted
from pipeline.storage.tables import read_columns
from trackably import plots
from trackably.gp.joint import JointPrior
from trackably.learning.landscape import Landscape, landscape
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.published.algorithm1 import SOUND as SOUND_READING
from trackably.learning.published.scalar import interval_sets
from trackably.learning.space import SearchSpace
from trackably.systems.reference import Reference

_STEPS_OF_TUBE = 12
_GRID_POINTS = 56
_SCHEME, _POINTS_OF_SCHEME = 2.0, 301  # until this multiple of the last sample's time
# The landscape spans these factors around the learned hyperparameters: an overview, and a closer view.
_OVERVIEW, _CLOSER = 8.0, 1.25


def applies_to(fitted: Fitted) -> bool:
    """Return whether there is a trace of Algorithm 1 in the reading that its proof supports."""
    return SOUND.name in fitted.traces


def drawings(experiment: Experiment, fitted: Fitted) -> dict[str, Callable[[], Figure]]:
    """Return the figures by name; none without a trace."""
    if not applies_to(fitted):
        return {}
    sound = fitted.learned[SOUND.name]
    final_step, plant = sound.final_step or 0, experiment.plant
    references = _references(fitted)
    (prior,) = sound.prior.parts
    last_sample = round(float(fitted.sampled.only.times[-1]) / plant.sampling_time)
    by_name: dict[str, Callable[[], Figure]] = {
        "scheme": lambda: _scheme(experiment, fitted),
        "tube": lambda: plots.tube(sound.reference, np.arange(_STEPS_OF_TUBE, dtype=float)),
        "asymptotic": lambda: plots.asymptotic(
            sound.reference, fitted.sampled.only, last_sample, final_step, round(1.5 * final_step)
        ),
        "prediction": lambda: _prediction(experiment, fitted, final_step),
    }
    if AS_PUBLISHED.name in fitted.traces:
        trace = fitted.traces[AS_PUBLISHED.name]
        curves = read_columns(experiment.published.iterations) if experiment.published.iterations else None
        by_name["convergence"] = lambda: plots.convergence(trace, interval_sets(plant)[0], prior.mean, curves)
    if len(prior.kernel.hyperparameters.keys() & sound.prior.learned) == 2:
        by_name["landscape"] = lambda: plots.landscape(
            landscapes(experiment, fitted), fitted.traces[SOUND.name], references
        )
    return by_name


def _scheme(experiment: Experiment, fitted: Fitted) -> Figure:
    (name,) = fitted.sampled.names
    times = np.linspace(0, _SCHEME * float(fitted.sampled.only.times[-1]), _POINTS_OF_SCHEME)
    truth = experiment.truths[name](times) if name in experiment.truths else None
    return plots.scheme(fitted.learned[JOINT.name].reference, fitted.sampled.only, times, truth)


def landscapes(experiment: Experiment, fitted: Fitted) -> Sequence[Landscape]:
    """Return the likelihood and the constraints of the sound reading's last iteration, around what was learned."""
    learned = fitted.learned[SOUND.name]
    (own,) = learned.prior.parts
    kernel = [name for name in own.kernel.hyperparameters if name in own.learned]
    # Where the noise is learned too, the landscape is cut at its learned value.
    prior = replace(own, noise_std=float(own.noise_std))
    space = experiment.search_space(fitted.sampled.samples)
    problem = ConstrainedProblem(
        fitted.sampled.samples,
        JointPrior((prior,)),
        SearchSpace({name: bounds for name, bounds in space.bounds.items() if name in kernel}),
        SOUND_READING.constraints(experiment.plant, learned.final_step or 0),
    )
    first, second = (prior.hyperparameters[name] for name in kernel)
    grids = []
    for factor in (_OVERVIEW, _CLOSER):
        spread = np.geomspace(1 / factor, factor, _GRID_POINTS)
        grids.append(landscape(problem, first * spread, second * spread))
    return grids


def _references(fitted: Fitted) -> dict[str, Reference]:
    shown = methods_in_figures(fitted.learned)
    return {method.name: fitted.learned[method.name].reference for method in shown}


def _prediction(experiment: Experiment, fitted: Fitted, final_step: int) -> Figure:
    steps = np.arange(round(1.5 * final_step) + 1, dtype=float)
    times = steps * experiment.plant.sampling_time
    truth = next((truth(times) for truth in experiment.truths.values()), None)
    return plots.prediction(
        fitted.sampled.only,
        _references(fitted),
        HYPERPARAMETERS.name,
        steps,
        true_reference=truth,
        published=_published(experiment),
        final_step=final_step,
    )


def _published(experiment: Experiment) -> plots.Published | None:
    if experiment.published.prediction is None:
        return None
    columns = read_columns(experiment.published.prediction)
    means = {name: columns[f"mean_{name}"] for name in ("unconstrained", "constrained")}
    return plots.Published(columns["k"], means, columns["successor_lower"], columns["successor_upper"])
