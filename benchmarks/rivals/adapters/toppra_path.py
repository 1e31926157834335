"""TOPP-RA: the path of the likeliest mean, in the shortest time that velocities and accelerations allow."""

import logging

import numpy as np
from scipy.interpolate import PPoly

from benchmarks.rivals.curves import is_driven_by_accelerations, moving
from benchmarks.rivals.model import Found, NotFound, Problem
from trackably.arrays import Array

_DEGREE = 6  # a cubic path of a quadratic parameter
_TIMES = 1000  # grid points: it is fast
_FAR = 1e3


def solve(problem: Problem) -> Found:
    """Follow the learned path from the first sample to the last, from rest to rest."""
    if not is_driven_by_accelerations(problem):
        raise NotFound("does not apply", "bounds velocities and accelerations; the system has other states")
    import toppra
    from toppra.algorithm import TOPPRA

    logging.getLogger("toppra").setLevel(logging.ERROR)
    task = problem.task
    first, last = problem.span
    at = np.linspace(first, last, _TIMES + 1)
    posterior = problem.likeliest.posterior
    learned = [
        samples.stencil.measured(signal, at) for signal, samples in zip(posterior.signals, task.samples, strict=True)
    ]
    grid = np.linspace(0.0, last - first, _TIMES + 1)
    path = toppra.SplineInterpolator(grid, np.stack(learned, axis=1))
    mixed, limits = _speeds(problem)
    bounded = toppra.SplineInterpolator(grid, np.stack(learned, axis=1) @ np.vstack([np.eye(len(learned)), mixed]).T)
    instance = TOPPRA(_constraints(problem, limits), bounded, gridpoints=grid, solver_wrapper="seidel")
    _, speeds, _ = instance.compute_parameterization(0.0, 0.0)
    if speeds is None or np.any(np.isnan(speeds)):
        raise NotFound("infeasible", "TOPP-RA finds no parametrisation")
    # Between two grid points its parameter accelerates evenly.
    lengths = 2 * np.diff(grid) / (speeds[1:] + speeds[:-1])
    times = np.concatenate([[0.0], np.cumsum(lengths)])
    took = float(times[-1])
    parameter = PPoly([np.diff(speeds) / lengths / 2, speeds[:-1], grid[:-1]], times)
    curve = moving(lambda t: path(float(parameter(t))), times, _DEGREE, problem)
    says = f"the same path at other times: {took:.3g} s instead of {last - first:.3g} s"
    return Found(curve, took, "duration [s]", _TIMES, says=says, ignores_samples=True, last=took)


def _speeds(problem: Problem) -> tuple[Array, Array]:
    """Return sums of velocities that are bounded, and the bounds: it bounds single ones, so that sums become paths."""
    m, bounded = problem.task.plant.signal_count, problem.task.plant.state_set
    chosen = ~np.any(bounded.rows[:, :m], axis=1)
    return bounded.rows[chosen, m:], np.stack([bounded.lower, bounded.upper], axis=1)[chosen]


def _constraints(problem: Problem, speeds: Array) -> list[object]:
    """Return bounds of all sums of velocities, and the polytope of accelerations."""
    from toppra import constraint as limits

    m = problem.task.plant.signal_count
    H, h = problem.task.plant.input_set.inequalities
    H = np.hstack([H, np.zeros((len(H), len(speeds)))])
    accelerations = limits.SecondOrderConstraint(
        lambda q, qd, qdd: qdd,
        lambda _: H,
        lambda _: h,
        m + len(speeds),
        discretization_scheme=limits.DiscretizationType.Interpolation,
    )
    return [limits.JointVelocityConstraint(np.vstack([np.full((m, 2), (-_FAR, _FAR)), speeds])), accelerations]
