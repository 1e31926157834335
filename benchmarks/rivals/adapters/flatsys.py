"""python-control: flatsys.point_to_point from the first state to rest, with constraints at many times."""

from typing import Any

import numpy as np

from benchmarks.rivals.curves import is_driven_by_accelerations, moving, of_states_and_inputs
from benchmarks.rivals.model import Found, NotFound, Problem
from trackably.arrays import Array
from trackably.systems.reference import Reference

_PIECES, _DEGREE = 8, 5
_TIMES = 60  # at which constraints are asked for: with 200 its optimiser needs minutes


def solve(problem: Problem) -> Found:
    """Move from where the likeliest mean is at the first sample to rest at the prior mean, with the least effort."""
    is_periodic = any("period" in name for name in problem.task.prior.hyperparameters)
    if is_periodic or not is_driven_by_accelerations(problem):
        raise NotFound("does not apply", "moves from one state to another; here there is no such motion")
    import control.flatsys as fs
    from scipy.optimize import LinearConstraint

    start, end = problem.span
    m = problem.task.plant.signal_count
    system = fs.FlatSystem(_flag, _states, inputs=m, outputs=2 * m, states=2 * m)
    basis = fs.BSplineFamily(np.linspace(0, end - start, _PIECES + 1), _DEGREE)
    levels = [part.mean for part in problem.task.prior.parts]
    last = np.array([functional.at_rest(levels) for functional in problem.task.plant.flatness.states])
    limits = of_states_and_inputs(problem.task.plant)
    trajectory = fs.point_to_point(
        system,
        np.linspace(0, end - start, _TIMES),
        _state(problem, start),
        np.zeros(m),
        last,
        np.zeros(m),
        cost=lambda x, u: float(u @ u),
        basis=basis,
        trajectory_constraints=[(LinearConstraint, limits.rows, limits.lower, limits.upper)],
        minimize_method="SLSQP",
        minimize_options={"maxiter": 200},
    )
    breaks = np.linspace(start, end, _PIECES + 1)
    says = "from the first state to rest; it takes no samples"
    curve = moving(lambda t: trajectory.eval(np.array([max(t - start, 0.0)]))[0][:m, 0], breaks, _DEGREE, problem)
    return Found(curve, None, "", _TIMES, says=says, ignores_samples=True, last=end)


def _flag(x: Array, u: Array, params: Any = None) -> list[Array]:
    return list(np.column_stack([*np.split(x, 2), u]))


def _states(flag: list[Array], params: Any = None) -> tuple[Array, Array]:
    positions, velocities, accelerations = np.array(flag).T
    return np.concatenate([positions, velocities]), accelerations


def _state(problem: Problem, t: float) -> Array:
    """Return the state of the likeliest mean, or the same at rest where it is out of bounds."""
    task = problem.task
    found = Reference(problem.likeliest.posterior.signals, task.plant).state_at(np.array(t))
    H, h = task.plant.state_set.inequalities
    return found if np.all(H @ found < h) else found * (np.arange(len(found)) < task.plant.signal_count)
