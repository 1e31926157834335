"""Bounded quantities at many times, as rows of one finite program: what rivals (b), (c) and (d) have in common."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.rivals.model import Problem
from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.rows import Rows, Terms, row_kernel
from trackably.gp.samples import Samples
from trackably.systems.trajectories import Functional

POINTS = 200
"""Times of the grid, if nothing else is said: as many as the published study of (c) begins with."""


@dataclass(frozen=True, eq=False)
class Grid:
    """All bounded quantities at all `times` [s]: `rows` with `lower` and `upper` bounds, quantity after quantity."""

    times: Array
    rows: Rows
    lower: Array
    upper: Array
    functionals: tuple[Functional, ...]

    @classmethod
    def of(cls, problem: Problem, points: int) -> "Grid | None":
        """Return as many times, evenly over the window; None where a quantity is no weighted sum of the signals."""
        times, quantities = np.linspace(*problem.window, points), problem.task.plant.quantities
        functionals = [q.functional for q in quantities]
        if any(functional is None for functional in functionals):
            return None
        known = tuple(f for f in functionals if f is not None)
        rows = Rows.joined([rows_of(f, times) for f in known], problem.task.plant.signal_count)
        lower = np.repeat([q.bounds.lower for q in quantities], points)
        return cls(times, rows, lower, np.repeat([q.bounds.upper for q in quantities], points), known)


def rows_of(functional: Functional, times: Array) -> Rows:
    """Return the functional at these times [s], one row for each."""
    terms = [Terms.joined([]) for _ in functional.weights]
    for c, weights in functional.rounded:
        instants = functional.instants(times, len(weights))
        of_row = np.broadcast_to(np.arange(len(times)), instants.shape)
        terms[c] = Terms(instants.ravel(), np.repeat(weights, len(times)), of_row.ravel())
    return Rows(np.full(len(times), float(functional.offset)), tuple(terms))


def sample_rows(problem: Problem) -> Rows:
    """Return the samples of all processes as rows, process after process."""
    count = problem.task.plant.signal_count
    parts = []
    for c, samples in enumerate(problem.task.samples):
        places = np.arange(len(samples))
        terms = [Terms.joined([]) for _ in range(count)]
        weights, step = samples.stencil.weights, samples.stencil.step
        shifted = np.concatenate([samples.times + j * step for j in range(len(weights))])
        terms[c] = Terms(shifted, np.repeat(weights, len(samples)), np.tile(places, len(weights)))
        parts.append(Rows(np.full(len(samples), samples.stencil.offset), tuple(terms)))
    return Rows.joined(parts, count)


def prior_covariance(posterior: JointPosterior, rows: Rows) -> Array:
    """Return the covariance of rows before any sample is seen: shape (n, n)."""
    pairs = zip(posterior.prior.parts, rows.terms, strict=True)
    each = (row_kernel(part.kernel, terms, len(rows)).among() for part, terms in pairs)
    return np.asarray(sum(each, np.zeros((len(rows), len(rows)))))


Basis = Callable[[Array], Array]
"""Functions at times (n,) [s], one column each: a signal is a sum of them."""


def bounds_by_basis(problem: Problem, times: Array, basis: Basis) -> tuple[Array, Array, Array]:
    """Return rows with lower and upper bounds of coefficients: all quantities at these times, quantity after quantity.

    A row has the coefficients of all signals, signal after signal.
    """
    plant, rows, lower, upper = problem.task.plant, [], [], []
    for q in plant.quantities:
        assert q.functional is not None, "asked for weighted sums"
        parts = [np.zeros_like(basis(times)) for _ in range(plant.signal_count)]
        for c, weights in q.functional.rounded:
            for j, w in enumerate(weights):
                parts[c] += w * basis(times + j * plant.sampling_time)
        offset = float(q.functional.offset)
        rows.append(np.hstack(parts))
        lower.append(np.full(len(times), q.bounds.lower - offset))
        upper.append(np.full(len(times), q.bounds.upper - offset))
    return np.vstack(rows), np.concatenate(lower), np.concatenate(upper)


def samples_by_basis(samples: Samples, basis: Basis) -> Array:
    """Return what samples show of each function, without their offset: shape (samples, functions)."""
    stencil = samples.stencil
    return np.asarray(sum(w * basis(samples.times + j * stencil.step) for j, w in enumerate(stencil.weights)))
