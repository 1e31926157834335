"""Periodic references of scalar systems: on the paper's grid, by its program (9), and at all phases."""

from collections.abc import Mapping

import numpy as np

from pipeline.methods.model import Failed, Fit, Task
from pipeline.methods.parameters import Periodic
from trackable.arrays import Array
from trackable.gp.joint import JointPrior
from trackable.learning.basins import Found
from trackable.learning.problem import Solution
from trackable.learning.published import periodic
from trackable.learning.published.periodic import Constraints
from trackable.learning.published.scalar import Scalar
from trackable.systems.constrained import ConstrainedSystem


def check(plant: ConstrainedSystem, prior: JointPrior) -> None:
    """Raise ValueError for a system that is not scalar, and TypeError for a kernel that is not periodic."""
    Scalar.of(plant)
    _period(prior)


def check_whole_steps(plant: ConstrainedSystem, prior: JointPrior) -> None:
    """Raise ValueError also where the period is learned, or is not a whole multiple of the sampling time."""
    check(plant, prior)
    if "period" in prior.learned:
        raise ValueError("needs a known period, but the period is learned")
    periodic.sampled(Scalar.of(plant), _period(prior))


def exact(task: Task) -> Fit | Failed:
    """Constrain all phases. The iterations are the rounds of the exchange that led to the best solution."""
    return _fit(task, solve(task, all_phases(task)), with_rounds=True)


def intervals(task: Task) -> Fit | Failed:
    """Solve program (9)."""
    return _fit(task, solve(task, program9(task, _wanted(task).intervals)))


def grid(task: Task) -> Fit | Failed:
    """Solve problem (6)."""
    return _fit(task, solve(task, periodic.grid(Scalar.of(task.plant), _wanted(task).last_step)))


def sampled(task: Task) -> Fit | Failed:
    """Constrain all instants that occur, for a known period of a whole number of steps."""
    return _fit(task, solve(task, periodic.sampled(Scalar.of(task.plant), _period(task.prior))))


def all_phases(task: Task) -> Constraints:
    """Return the constraints of the exact form."""
    return periodic.exact(task.plant, _wanted(task).backoff)


def program9(task: Task, count: int) -> Constraints:
    """Return the constraints of program (9) with η = `count`."""
    wanted = _wanted(task)
    return periodic.intervals(Scalar.of(task.plant), wanted.last_step, count, wanted.backoff)


def solve(task: Task, constraints: Constraints) -> Found:
    """Find the best reference that keeps the constraints; all of them from the same starts."""
    return periodic.learn(task.samples, task.prior, task.plant, task.space, constraints)


def _fit(task: Task, found: Found, *, with_rounds: bool = False) -> Fit | Failed:
    task.on_fit()
    if not isinstance(found.outcome, Solution):
        return Failed(found.outcome.explanation)
    return Fit(found.outcome, found.outcome.fits, iterations=_rounds(task, found) if with_rounds else {})


def _rounds(task: Task, found: Found) -> Mapping[str, Array]:
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


def _period(prior: JointPrior) -> float:
    return periodic.period_of([part.kernel for part in prior.parts])
