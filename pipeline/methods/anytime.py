"""Methods for every system and claim: without constraints, and with a proof."""

from collections.abc import Mapping

import numpy as np

from pipeline.methods.model import Failed, Fit, Task
from trackable.arrays import Array
from trackable.certificates.certified import Certified, Round, learn_certified
from trackable.learning import methods
from trackable.learning.problem import Solution


def unconstrained(task: Task) -> Fit | Failed:
    """Maximise the likelihood, and constrain nothing."""
    found = methods.unconstrained(task.samples, task.prior, task.plant, task.space)
    task.on_fit()
    if not isinstance(found, Solution):
        return Failed(found.explanation)
    return Fit(found, found.fits)


def certified(task: Task) -> Fit | Failed:
    """Learn with a proof of the experiment's claim."""
    rounds: list[Round] = []

    def on_round(done: Round) -> None:
        rounds.append(done)
        task.on_fit()

    found = learn_certified(task.samples, task.prior, task.plant, task.space, task.goal, on_round)
    if not isinstance(found, Certified):
        return Failed(found.explanation)
    return Fit(found.solution, found.solution.fits, iterations=_columns(rounds))


def _columns(rounds: list[Round]) -> Mapping[str, Array]:
    return {
        "round": np.arange(1.0, len(rounds) + 1),
        "backoff": np.array([done.backoff for done in rounds]),
        "objective": np.array([done.objective for done in rounds]),
        "proved": np.array([float(done.proved) for done in rounds]),
    }
