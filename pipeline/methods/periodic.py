"""Periodic references of scalar systems: on the paper's grid, by its program (8), and at all phases."""

from collections.abc import Mapping

import numpy as np

from pipeline.methods.model import Failed, Fit, Task
from pipeline.methods.parameters import Periodic
from trackably.arrays import Array
from trackably.gp.joint import JointPrior
from trackably.gp.period import period_of
from trackably.learning import methods
from trackably.learning.problem import NoSolution, Solution
from trackably.learning.published import periodic
from trackably.learning.published.periodic import steps_of_period
from trackably.learning.published.scalar import state_and_input
from trackably.systems.constrained import ConstrainedSystem


def check(plant: ConstrainedSystem, prior: JointPrior) -> None:
    """Raise ValueError for a system that is not scalar, and TypeError for a kernel that is not periodic."""
    state_and_input(plant)
    period_of([part.kernel for part in prior.parts])


def check_whole_steps(plant: ConstrainedSystem, prior: JointPrior) -> None:
    """Raise ValueError also where the period is learned, or is not a whole multiple of the sampling time."""
    check(plant, prior)
    steps_of_period(prior, plant)


def exact(task: Task) -> Fit | Failed:
    """Constrain all phases. The iterations are the rounds of the exchange that led to the best solution."""
    found = at_all_phases(task)
    return _fit(task, found, _rounds(task, found) if isinstance(found, Solution) else {})


def intervals(task: Task) -> Fit | Failed:
    """Solve program (8) as published."""
    return _fit(task, on_intervals(task, _wanted(task).intervals))


def sound_intervals(task: Task) -> Fit | Failed:
    """Solve program (8) with growth rates that also cover the steps from one interval into the next."""
    wanted = _wanted(task)
    found = periodic.sound_intervals(
        task.samples, task.prior, task.plant, task.space, wanted.last_step, wanted.intervals, wanted.backoff
    )
    return _fit(task, found)


def grid(task: Task) -> Fit | Failed:
    """Solve problem (4)."""
    found = periodic.grid(task.samples, task.prior, task.plant, task.space, _wanted(task).last_step)
    return _fit(task, found)


def sampled(task: Task) -> Fit | Failed:
    """Constrain all instants that occur, for a known period of a whole number of steps."""
    return _fit(task, periodic.sampled(task.samples, task.prior, task.plant, task.space))


def at_all_phases(task: Task) -> Solution | NoSolution:
    """Find the best reference that keeps its bounds at all phases."""
    return methods.exact(task.samples, task.prior, task.plant, task.space, _wanted(task).backoff)


def on_intervals(task: Task, count: int) -> Solution | NoSolution:
    """Solve program (8) with η = `count`."""
    wanted = _wanted(task)
    return periodic.intervals(task.samples, task.prior, task.plant, task.space, wanted.last_step, count, wanted.backoff)


def _fit(task: Task, found: Solution | NoSolution, iterations: Mapping[str, Array] | None = None) -> Fit | Failed:
    if not isinstance(found, Solution):
        return Failed(found.explanation)
    return Fit(found, found.fits, iterations=iterations or {})


def _rounds(task: Task, found: Solution) -> Mapping[str, Array]:
    log_theta = np.array([r.log_theta for r in found.rounds]).reshape(len(found.rounds), -1)
    return {
        "round": np.arange(1.0, len(found.rounds) + 1),
        **dict(zip(task.prior.learned, np.exp(log_theta).T, strict=False)),
        "objective": np.array([r.objective for r in found.rounds]),
        "relative_margin": np.array([r.margin for r in found.rounds]),
        "places": np.array([float(r.places) for r in found.rounds]),
    }


def _wanted(task: Task) -> Periodic:
    assert task.parameters.periodic, "the experiment was checked for what its methods need"
    return task.parameters.periodic
