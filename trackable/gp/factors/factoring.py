"""Which factor of K + V: the cheapest of those that rounding allows."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from trackable.arrays import Array
from trackable.gp.factors.band import Band, blocks, reach
from trackable.gp.factors.bases import ROUNDING
from trackable.gp.factors.dense import Dense
from trackable.gp.factors.factored import Covariance, Factored
from trackable.gp.factors.grid import Grid
from trackable.gp.factors.smooth import Smooth
from trackable.gp.factors.toeplitz import Toeplitz
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples

LARGEST_DENSE = 4000  # samples; beyond them a dense matrix takes gigabytes, and minutes
_LARGEST_BLOCK = LARGEST_DENSE // 2
_FEWEST = 150  # samples: fewer, and a dense matrix is done before anybody has looked for structure
_NEGLIGIBLE = 2.0**-53  # of the variance: added to a diagonal, it would be rounded away
_AGREEMENT = 3e-9  # with the dense path, relative: less than is promised (1e-8), for what is compared is an estimate
_ROUGHLY = 1e3  # where the dense path is no alternative
_EPS = float(np.finfo(float).eps)


def noise_variance(prior: Prior, samples: Samples) -> Array:
    """That of each sample, shape (n,)."""
    return np.asarray((prior.noise_std * samples.relative_noise) ** 2)


class Way(NamedTuple):
    """A function that makes a factor, or None where A is not positive definite in float64; about `cost` nanoseconds."""

    cost: float
    make: Callable[[], Factored | None]


def factored(prior: Prior, samples: Samples, covariance: Covariance) -> Factored | None:
    """K + V by the `covariance` of what is sampled; None where it is not positive definite in float64."""
    if len(samples) < _FEWEST:
        return Dense.of(samples.times, covariance, noise_variance(prior, samples))
    found = (way.make() for way in sorted(ways(prior, samples, covariance), key=lambda way: way.cost))
    return next((factor for factor in found if factor is not None), None)


def ways(prior: Prior, samples: Samples, covariance: Covariance) -> list[Way]:
    """All that lead to the same answers. Their costs were measured on one machine: only the order counts."""
    n, found = len(samples), list(_structured(prior, samples, covariance))
    if n <= LARGEST_DENSE or not found:
        dense = partial(Dense.of, samples.times, covariance, noise_variance(prior, samples))
        found.append(Way(0.025 * n**3 + 8 * n**2, dense))
    return found


def _structured(prior: Prior, samples: Samples, covariance: Covariance) -> Iterator[Way]:
    """Where entries of K are uncertain by η, weights, mean and gradients differ by about √n η/σ_n² (relative)."""
    variances = noise_variance(prior, samples)
    n, times, kernel, lags = len(samples), samples.times, prior.kernel, samples.stencil.lags
    span, gain = float(times[-1] - times[0]), sum(abs(rho) for rho, _ in lags)
    (variance,), _ = covariance(np.zeros(1))
    largest = gain * kernel(np.zeros(())).item()
    slope = largest / kernel.correlation_time  # |κ̇|² ≤ κ(0) |κ̈(0)| for every covariance
    if not (variance > 0 and np.isfinite(slope)):
        return
    held = _AGREEMENT * float(np.min(variances)) / np.sqrt(n)
    allowed = held if n <= LARGEST_DENSE else np.inf
    entries, lengths = _EPS * largest, _EPS * slope * span  # rounding of values, and of distances in time

    if entries <= allowed and np.isfinite(kernel.decay_distance):
        rows = blocks(times, reach(kernel, span, _NEGLIGIBLE * variance / gain) + abs(lags[-1][1]))
        if len(rows) > 2 and max(row.stop - row.start for row in rows) <= _LARGEST_BLOCK:
            yield Way(_cost_of_band(rows), partial(Band.of, times, rows, covariance, variances))

    # Chebyshev points of times that do not begin at 0 have to be moved there, to where float64 has instants.
    moved = float(np.spacing(np.max(np.abs(times)))) if times[0] else 0.0
    placed = slope * moved <= (held if n <= LARGEST_DENSE else _ROUGHLY * held)
    resolved = placed and kernel.is_analytic and ROUNDING * largest + lengths <= allowed
    if resolved and (m := samples.bases.points_for(covariance, n // 2)):
        known = samples.relative_noise, prior.noise_std**2
        cost = 0.2 * m**3 + 12 * m**2 + 4 * n * m + 0.01 * n * m**2 + 2e5  # a basis serves some ten times
        yield Way(cost, lambda: Smooth.of(samples.bases.of(m), covariance, *known))

    grid = Grid.of(times) if np.all(variances == variances[0]) else None
    if grid and entries + lengths + 2 * slope * grid.deviation <= allowed:
        yield Way(0.6 * n**2 + 1200 * n, partial(Toeplitz.of, grid, covariance, float(variances[0])))


def _cost_of_band(rows: list[slice]) -> float:
    own = np.array([row.stop - row.start for row in rows], dtype=float)
    after = np.append(own[1:], 0.0)
    return float(np.sum(0.04 * own**3 + 0.08 * own * after * (own + after) + 8 * own * (own + after) + 5e4))
