"""What room for disturbances costs, for other sizes of their sets."""

from dataclasses import replace
from fractions import Fraction
from functools import partial

import numpy as np

from pipeline.experiments import Experiment
from pipeline.methods import JOINT, ROBUST, UNCONSTRAINED
from pipeline.storage.archive import Fitted
from pipeline.storage.sampled import Sampled
from trackably.arrays import Array
from trackably.certificates.certified import Certified, learn_certified
from trackably.learning import learner
from trackably.learning.joint.learn import learn_from
from trackably.systems.disturbance.tightening import Tightening, tightening
from trackably.systems.reference import Reference

Columns = dict[str, list[float] | float]


def prices(experiment: Experiment, fitted: Fitted) -> Columns:
    """Return `sizes` of both sets, as parts of the given ones, and for each the `price` J − min l and the `misfit`.

    Zero is the reference `joint`, one the reference `robust`; those between and beyond are learned here, from the
    hyperparameters of their neighbours, for the same feedback, and proved. Sizes without a proved reference are left
    out. `largest` is the size at which nothing is left of the bounds.
    """
    drawn_in = experiment.tightening
    assert drawn_in, "asked for where there is a disturbance"
    assert experiment.disturbance, "bounds are drawn in for one"
    least = fitted.learned[UNCONSTRAINED.name].nlml
    rows = {
        size: (fitted.learned[name].objective - least, _misfit(fitted.sampled, fitted.learned[name].reference))
        for size, name in ((0.0, JOINT.name), (1.0, ROBUST.name))
    }
    start = fitted.learned[ROBUST.name].prior.log_hyperparameters
    for size in sorted(experiment.disturbance.sizes):
        found = _learned(experiment, fitted.sampled, drawn_in, size, start)
        if found is not None:
            rows[size] = (found.solution.objective - least, _misfit(fitted.sampled, found.reference))
            start = found.solution.posterior.prior.log_hyperparameters
    return {
        "sizes": sorted(rows),
        "price": [rows[size][0] for size in sorted(rows)],
        "misfit": [rows[size][1] for size in sorted(rows)],
        "largest": drawn_in.largest_fraction,
    }


def scaled(drawn_in: Tightening, size: float) -> Tightening:
    """Return the bounds drawn in for sets of another size. Raises ValueError where nothing is left of them."""
    W, V, by = drawn_in.disturbance, drawn_in.noise, Fraction(size)
    assert W is not None, "asked for where there is a disturbance"
    assert drawn_in.invariant is not None, "it belongs to a disturbance"
    noise = None if V is None else V.scaled(by)
    return tightening(drawn_in.given, W.scaled(by), drawn_in.invariant.feedback, drawn_in.margin, noise)


def _learned(
    experiment: Experiment, sampled: Sampled, drawn_in: Tightening, size: float, start: Array
) -> Certified | None:
    try:
        plant = scaled(drawn_in, size).plant
    except ValueError:  # nothing is left
        return None
    task = experiment.task(sampled.samples)
    nearby = replace(learner.JOINT, solve=partial(learn_from, (start,)), second_choice=None)
    found = learn_certified(task.samples, task.prior, plant, task.space, task.goal, learner=nearby)
    return found if isinstance(found, Certified) else None


def _misfit(sampled: Sampled, reference: Reference) -> float:
    """Return the root mean square of samples minus reference, all that is sampled having the same weight."""
    return float(np.sqrt(np.mean([*sampled.mean_squares(reference.signals).values()])))
