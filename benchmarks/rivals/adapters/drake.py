"""Drake: KinematicTrajectoryOptimization, a B-spline through the samples with bounds of its control points."""

from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from benchmarks.rivals.curves import is_driven_by_accelerations, moving
from benchmarks.rivals.model import Found, NotFound, Problem
from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.trajectories import Quantity

_ORDER = 6
_FEWEST, _MOST = 24, 60


def solve(problem: Problem) -> Found:
    """Bring the spline as near to the samples as bounds allow: about as many control points as samples."""
    if not is_driven_by_accelerations(problem):
        raise NotFound("does not apply", "bounds positions, velocities and accelerations; the system has other states")
    from pydrake.planning import KinematicTrajectoryOptimization
    from pydrake.solvers import Solve

    task, m = problem.task, problem.task.plant.signal_count
    start, end = 0.0, problem.span[1]
    count = int(np.clip(max(len(samples) for samples in task.samples), _FEWEST, _MOST))
    planned = KinematicTrajectoryOptimization(m, count, _ORDER, end - start)
    planned.AddDurationConstraint(end - start, end - start)
    positions, velocities, accelerations = _boxes(task.plant)
    planned.AddPositionBounds(*positions)
    planned.AddVelocityBounds(*velocities)
    planned.AddAccelerationBounds(*accelerations)
    program = planned.get_mutable_prog()
    points = planned.control_points()
    basis = planned.basis()
    spline = BSpline(np.array(basis.knots()) * (end - start), np.eye(count), _ORDER - 1)
    # From control points to those of q, q̇ and q̈; SciPy pads the latter with zeros.
    derivatives = [spline.derivative(order).c[: count - order] for order in range(3)]
    for limit in task.plant.given_constraints:
        _add_row(program, points, limit, derivatives, m)
    for c, samples in enumerate(task.samples):
        weights = np.array([[basis.EvaluateBasisFunctionI(i, t / end) for i in range(count)] for t in samples.times])
        noise = float(np.ptp(samples.values))
        program.Add2NormSquaredCost(weights / noise, samples.values / noise, points[c])
    guess = np.array([np.interp(np.linspace(0, end, count), s.times, s.values) for s in task.samples])
    program.SetInitialGuess(points, guess)
    result = Solve(program)
    if not result.is_success():
        raise NotFound("failed", f"Drake's {result.get_solver_id().name()} says {result.get_solution_result().name}")
    trajectory = planned.ReconstructTrajectory(result)
    breaks = np.unique(np.clip(np.array(basis.knots()) * (end - start), start, end))
    curve = moving(lambda t: trajectory.value(t)[:, 0], breaks, _ORDER - 1, problem)
    objective = float(result.get_optimal_cost())
    says = f"{count} control points of order {_ORDER}, solved by {result.get_solver_id().name()}"
    return Found(curve, objective, "Σ (y − q)², scaled", None, says=says, last=end)


_FAR = 1e3


def _boxes(plant: ConstrainedSystem) -> list[Array]:
    """Return bounds (2, m) of positions, velocities and accelerations; far ones where there are none."""
    sets = (plant.state_set, plant.input_set)
    extents = [bounded.extent(i) or Interval(-_FAR, _FAR) for bounded in sets for i in range(bounded.dimension)]
    return np.split(np.array([[of.lower, of.upper] for of in extents]).T, 3, axis=1)


def _add_row(program: Any, points: Any, limit: Quantity, derivatives: list[Array], m: int) -> None:
    """Bound a row that mixes positions, velocities or accelerations of one kind, at its control points."""
    touched = [i for i, w in enumerate(limit.row) if w]
    if len(touched) == 1:
        return
    kinds = {i // m for i in touched}
    if len(kinds) > 1:
        raise NotImplementedError("a row of positions and velocities")
    matrix = derivatives[2 if limit.side == "input" else kinds.pop()]
    rows = np.hstack([float(limit.row[i]) * matrix for i in touched])
    unknown = np.concatenate([points[i % m] for i in touched])
    low, high = np.full(len(matrix), limit.bounds.lower), np.full(len(matrix), limit.bounds.upper)
    program.AddLinearConstraint(rows, low, high, unknown)
