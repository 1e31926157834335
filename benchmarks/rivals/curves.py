"""What rivals find, as curves of a problem's plant, which the judge reads.

Rivals that know no sampled systems are judged as they see the system: x = (p, ṗ), u = p̈ at all times. Sequences are
judged at their steps: between them there are straight lines, which keep the bounds where their ends do.
"""

from collections.abc import Callable, Sequence

import numpy as np
import scipy
from scipy.interpolate import PPoly

from benchmarks.rivals.judge import Curve, tracing
from benchmarks.rivals.model import Problem
from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.pieces import PolynomialPieces, Signal
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference


def curve_of(signals: Sequence[Signal], problem: Problem) -> Curve:
    """Return the curve of a problem's flat outputs."""
    stencils = tuple(samples.stencil for samples in problem.task.samples)
    return Curve(Reference(tuple(signals), problem.task.plant), stencils)


def is_driven_by_accelerations(problem: Problem) -> bool:
    """Whether the sampled system is ṗ = v, v̇ = u with as many inputs as positions."""
    written, m = problem.experiment.system.fields, problem.task.plant.signal_count
    if not written.get("continuous", False):
        return False
    return np.array_equal(written["A"], np.eye(2 * m, k=m)) and np.array_equal(written["B"], np.eye(2 * m, m, k=-m))


def moving(position: Callable[[float], Array], breaks: Array, degree: int, problem: Problem) -> Curve:
    """Return the curve of positions (m,), polynomials between their breaks, with their speeds and accelerations."""
    positions = interpolated(position, breaks, degree)
    moved = (positions, positions.derivative(), positions.derivative(2))
    return _through([PolynomialPieces(breaks, c) for of in moved for c in of.c[::-1].T], problem.task.plant)


def interpolated(function: Callable[[float], Array], breaks: Array, degree: int) -> PPoly:
    """Return the polynomials of this degree that a function is between its breaks, up to rounding in float64."""
    nodes, lengths = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2, np.diff(breaks)
    values = np.array([[function(t) for t in at] for at in (breaks[:-1] + np.outer(nodes, lengths)).tolist()])
    scaled = np.linalg.solve(np.vander(nodes), values.reshape(degree + 1, -1)).reshape(values.shape)
    return PPoly(scaled / lengths[:, None] ** np.arange(degree, -1.0, -1)[:, None, None], breaks)


def integrated(f: Callable[[Array], Array], breaks: Array, nodes: int) -> Array:
    """Return ∫ f fᵀ of functions f (times, n), by Gauss's rule with this many nodes between two breaks."""
    at, weights = np.polynomial.legendre.leggauss(nodes)
    half = np.diff(breaks)[:, None] / 2
    values = f((breaks[:-1, None] + half * (1 + at)).ravel())
    return np.asarray(values.T @ ((half * weights).reshape(-1, 1) * values))


def stepping(states: Array, inputs: Array, problem: Problem) -> Curve:
    """Return the curve of states (K + 1, n) and inputs (K, m) at steps; samples show the first states."""
    plant = problem.task.plant
    steps = (plant.sampling_time * np.arange(len(states))).tolist()
    values = np.hstack([states, np.vstack([inputs, inputs[-1:]])]).T.tolist()
    lines = [PolynomialPieces.lines(dict(zip(steps, of, strict=True))) for of in values]
    return _through(lines, plant, at_steps=True)


def _through(signals: Sequence[PolynomialPieces], plant: ConstrainedSystem, at_steps: bool = False) -> Curve:
    return tracing(signals, (*plant.system.states, *plant.system.inputs), of_states_and_inputs(plant), at_steps)


def of_states_and_inputs(plant: ConstrainedSystem) -> Polytope:
    """Return both sets as one, of (x, u)."""
    bounded = plant.state_set, plant.input_set
    rows = scipy.linalg.block_diag(*(of.rows for of in bounded))
    ends = (np.concatenate([getattr(of, end) for of in bounded]) for end in ("lower", "upper"))
    return Polytope(rows, *ends, rows.shape[1])
