"""Bounded quantities at many times, as rows of one finite program: what rivals (b), (c) and (d) have in common."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from benchmarks.rivals.model import NotFound, Problem
from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.rows import Rows, row_kernel
from trackably.learning.constraint import rows_of
from trackably.systems.trajectories import Functional

POINTS = 200
"""Times of the grid, if nothing else is said: as many as the published study of (c) begins with."""


@dataclass(frozen=True, eq=False)
class Grid:
    """All bounded quantities at some times: `rows` with `lower` and `upper` bounds, quantity after quantity."""

    rows: Rows
    lower: Array
    upper: Array
    functionals: tuple[Functional, ...]

    @classmethod
    def of(cls, problem: Problem, times: Array) -> "Grid":
        """Return the bounds at these times [s]. NotFound: a quantity is no weighted sum of the signals."""
        quantities = problem.task.plant.quantities
        known = tuple(q.functional for q in quantities if q.functional is not None)
        if len(known) < len(quantities):
            raise NotFound("does not apply", "is for weighted sums of the signal; an input is none")
        rows = rows_of([(functional, times) for functional in known], problem.task.plant.signal_count)
        lower, upper = (
            np.repeat([getattr(q.bounds, end) for q in quantities], len(times)) for end in ("lower", "upper")
        )
        return cls(rows, lower, upper, known)


def evenly(problem: Problem, points: int) -> Array:
    """Return as many times [s], evenly over the window."""
    return np.linspace(*problem.window, points)


def sample_rows(problem: Problem) -> Rows:
    """Return the samples of all processes as rows, process after process."""
    shown, nothing = [], [(Fraction(0),)] * problem.task.plant.signal_count
    for c, samples in enumerate(problem.task.samples):
        stencil = samples.stencil
        weights = (*nothing[:c], tuple(map(Fraction, stencil.weights)), *nothing[c + 1 :])
        shown.append((Functional(Fraction(stencil.offset), weights, stencil.step), samples.times))
    return rows_of(shown, len(nothing))


def prior_covariance(posterior: JointPosterior, rows: Rows) -> Array:
    """Return the covariance of rows before any sample is seen: shape (n, n)."""
    pairs = zip(posterior.prior.parts, rows.terms, strict=True)
    each = (row_kernel(part.kernel, terms, len(rows)).among() for part, terms in pairs)
    return np.asarray(sum(each, np.zeros((len(rows), len(rows)))))


_NEGLIGIBLE = 1e-12  # smaller eigenvalues, relative to the largest, are dropped: they are rounding errors


def root(covariance: Array) -> Array:
    """Return F (n, r) with F Fᵀ = Σ, up to 1e-12 n of each variance, for a covariance Σ (n, n) of any rank.

    F has few columns where the values depend on each other, as those of a smooth process at close times do. Rows are
    scaled to the same variance before, so that their units do not matter.
    """
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(std > 0, std, np.inf)
    values, vectors = np.linalg.eigh(covariance / scale / scale[:, None])
    kept = values > _NEGLIGIBLE * values[-1]
    return np.asarray(std[:, None] * vectors[:, kept] * np.sqrt(values[kept]))


Basis = Callable[[Array], Array]
"""Functions at times (n,) [s], one column each: a signal is a sum of them."""


def by_basis(rows: Rows, basis: Basis) -> Array:
    """Return rows (n, m · functions), less their offsets, of the coefficients of m signals, signal after signal."""
    return np.hstack([terms.summed(basis(terms.times), len(rows)) for terms in rows.terms])
