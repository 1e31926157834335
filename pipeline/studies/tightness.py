"""What a proved reference costs, and how far it is from samples and truth, as a bound of the state is drawn in."""

import numpy as np

from pipeline.experiments import Experiment
from pipeline.methods import METHODS, Failed
from trackably.gp.samples import Samples
from trackably.systems.reference import Reference


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
