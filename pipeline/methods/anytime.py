"""Methods for every system and claim: without constraints, and with a proof, in two ways."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from pipeline.methods.model import Failed, Fit, Task
from trackably.arrays import Array
from trackably.certificates.certified import Attempt, Certified, learn_certified
from trackably.learning import methods
from trackably.learning.learner import Learner
from trackably.learning.problem import Solution


def unconstrained(task: Task) -> Fit | Failed:
    """Maximise the likelihood, and constrain nothing."""
    found = methods.unconstrained(task.samples, task.prior, task.plant, task.space)
    if not isinstance(found, Solution):
        return Failed(found.explanation)
    return Fit(found, found.fits)


def certified_by(learner: Learner) -> Callable[[Task], Fit | Failed]:
    """Return the method that learns in this way, with a proof of the experiment's claim."""
    return partial(_certified, learner)


def _certified(learner: Learner, task: Task) -> Fit | Failed:
    attempts: list[Attempt] = []
    found = learn_certified(task.samples, task.prior, task.plant, task.space, task.goal, attempts.append, learner)
    if not isinstance(found, Certified):
        return Failed(found.explanation)
    return Fit(found.solution, found.solution.fits, iterations=_columns(attempts))


def _columns(attempts: list[Attempt]) -> Mapping[str, Array]:
    return {
        "round": np.arange(1.0, len(attempts) + 1),
        "backoff": np.array([attempt.backoff for attempt in attempts]),
        "objective": np.array([attempt.objective for attempt in attempts]),
        "proved": np.array([float(attempt.proved) for attempt in attempts]),
    }
