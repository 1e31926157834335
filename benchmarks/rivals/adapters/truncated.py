"""The finite-dimensional truncated Gaussian process: hat functions whose values at knots keep the bounds.

A. F. López-Lopera, F. Bachoc, N. Durrande and O. Roustant, Finite-dimensional Gaussian approximation with linear
inequality constraints (SIAM/ASA JUQ 6, 2018): g = Σ_j ξ_j φ_j with hats φ_j at knots and ξ ~ N(m, K), K that of the
knots, given Φ ξ + noise = y and lower ≤ Λ ξ ≤ upper. The mode, the most likely ξ, is a quadratic program.

Sums of shifted hats are linear between shifted knots: bounds at all of these hold at all times.
"""

from functools import partial

import numpy as np
import scipy

from benchmarks.rivals.adapters.convex import shortest
from benchmarks.rivals.adapters.rows import Grid, by_basis, root
from benchmarks.rivals.curves import curve_of
from benchmarks.rivals.model import Found, NotFound, Problem
from trackably.arrays import Array
from trackably.systems.pieces import PolynomialPieces

_MOST_KNOTS = 700


def most_likely(mean: Array, factor: Array, rows: Array, lower: Array, upper: Array) -> Array:
    """Return the most likely ξ = `mean` + `factor` w at knots, w ~ N(0, I), with `lower` ≤ `rows` ξ ≤ `upper`."""
    at = rows @ mean
    return np.asarray(mean + factor @ shortest(rows @ factor, lower - at, upper - at).w)


def conditioned(covariance: Array, prior_mean: Array, seen: Array, noise: Array, values: Array) -> tuple[Array, Array]:
    """Return mean and root of ξ given `seen` ξ + noise = `values`; standard deviations of noise may be zero."""
    across = covariance @ seen.T
    among = seen @ across + np.diag(noise**2)
    gain = np.linalg.solve(among, across.T).T
    after = covariance - gain @ across.T
    return prior_mean + gain @ (values - seen @ prior_mean), root((after + after.T) / 2)


def solve(problem: Problem) -> Found:
    """Return the mode, with a knot at every sampling instant."""
    task = problem.task
    step = task.plant.sampling_time
    longest = max(task.plant.flatness.orders)
    knots = step * np.arange(round(problem.window[1] / step) + longest + 1)
    grid = Grid.of(problem, knots[: len(knots) - longest])
    if len(knots) > _MOST_KNOTS:
        raise NotFound("does not apply", f"{len(knots)} knots, one for each sampling instant, are too many here")
    posterior, basis = problem.likeliest.posterior, partial(hats, knots=knots)
    parts = []
    for part in posterior.parts:
        samples, stencil = part.samples, part.samples.stencil
        seen = stencil.measured(basis, samples.times) - stencil.offset
        noise, values = float(part.prior.noise_std) * samples.relative_noise, samples.values - stencil.offset
        level = np.full(len(knots), part.prior.mean)
        covariance = np.asarray(part.prior.kernel(knots[:, None] - knots))
        parts.append(conditioned(covariance, level, seen, noise, values))
    means, roots = zip(*parts, strict=True)
    lower, upper = (ends - grid.rows.offsets for ends in (grid.lower, grid.upper))
    whole = np.concatenate(means), scipy.linalg.block_diag(*roots)
    found = most_likely(*whole, by_basis(grid.rows, basis), lower, upper)
    lines = (dict(zip(knots.tolist(), values.tolist(), strict=True)) for values in np.split(found, len(parts)))
    curve = curve_of([PolynomialPieces.lines(values) for values in lines], problem)
    return Found(curve, None, "", len(knots), says=f"{len(knots)} knots")


def hats(t: Array, knots: Array) -> Array:
    """Return the hat functions at t: shape (t, knots)."""
    return np.stack([np.interp(t, knots, row) for row in np.eye(len(knots))], axis=1)
