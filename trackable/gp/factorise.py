"""Factorise K + V in the fastest way that is exact up to rounding."""

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from trackable.arrays import Array
from trackable.gp.factors.band import Band, blocks, reach
from trackable.gp.factors.chebyshev import ROUNDING
from trackable.gp.factors.dense import Dense
from trackable.gp.factors.factorisation import Covariance, Factorisation
from trackable.gp.factors.fourier import Fourier
from trackable.gp.factors.grid import Grid
from trackable.gp.factors.low_rank import LowRank
from trackable.gp.factors.markov.markov import Markov
from trackable.gp.factors.toeplitz import Toeplitz
from trackable.gp.kernels.matern import Matern
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples
from trackable.gp.stencil import Stencil
from trackable.gp.stencils import Stencils

LARGEST_DENSE = 4000  # samples: a larger dense matrix takes gigabytes of memory and minutes of time
_LARGEST_BLOCK = LARGEST_DENSE // 2
_FEWEST = 200  # samples: for fewer, the dense matrix is faster than looking for structure
_FEWEST_OF_WAVES = 50  # samples: for fewer, the dense matrix is always faster
_MOST_WAVES = 0.65  # for each sample: with more, the dense matrix is faster
_NEGLIGIBLE = 2.0**-53  # of the variance: a smaller addition to a diagonal entry is lost in rounding
_AGREEMENT = 3e-9  # relative, with the dense factorisation: less than the promised 1e-8, as errors are only estimated
_PRECISE = 1e-10  # the largest estimated error of band matrices: that of gradients may be a hundred times as large
_LOOSENED = 1e3  # the factor by which the agreement is loosened where a dense matrix would be too large
_EPS = float(np.finfo(float).eps)


def noise_variance(prior: Prior, samples: Samples) -> Array:
    """Return σ_n² ϱ_i² of each sample i, shape (n,)."""
    return np.asarray(prior.noise_std**2 * samples.relative_variance)


def factorise_kinds(prior: Prior, samples: Samples, stencils: Stencils) -> Factorisation | None:
    """Factorise K + V of samples of several kinds; None as `factorise`. ValueError: too many for a dense matrix."""
    if len(samples) > LARGEST_DENSE:
        raise ValueError(
            f"samples: {len(samples)} of {' and '.join(stencils.names)} are too many to learn from together; thin them "
            f"out to {LARGEST_DENSE}, or give one of them"
        )
    return Dense.of(stencils.entries(prior.kernel, samples.times), noise_variance(prior, samples))


class Candidate(NamedTuple):
    """A way to factorise A = K + V: `compute` takes about `cost` nanoseconds; None if A is not positive definite."""

    cost: float
    compute: Callable[[], Factorisation | None]


def factorise(prior: Prior, samples: Samples, covariance: Covariance) -> Factorisation | None:
    """Factorise K + V, K being the `covariance` of the samples; None if it is not positive definite in float64."""
    if len(samples) < _FEWEST:
        spectral = waves(prior, samples) if len(samples) >= _FEWEST_OF_WAVES else None
        return (spectral and spectral.compute()) or unstructured(prior, samples, covariance)
    found = (each.compute() for each in sorted(candidates(prior, samples, covariance), key=lambda each: each.cost))
    return next((factor for factor in found if factor is not None), None)


def unstructured(prior: Prior, samples: Samples, covariance: Covariance) -> Dense | None:
    """Factorise K + V without looking for structure; None as `factorise`."""
    return Dense.of(lambda part: covariance(samples.apart[part]), noise_variance(prior, samples))


def candidates(prior: Prior, samples: Samples, covariance: Covariance) -> list[Candidate]:
    """Return all factorisations that are exact up to rounding.

    Their costs were measured on one machine; only their order matters.
    """
    n, found = len(samples), list(_structured(prior, samples, covariance))
    if n <= LARGEST_DENSE or not found:
        found.append(Candidate(0.025 * n**3 + 8 * n**2, partial(unstructured, prior, samples, covariance)))
    return found


def waves(prior: Prior, samples: Samples) -> Candidate | None:
    """Return the factorisation in cosines and sines; None where these are not well below the samples in number.

    It computes nothing where rounding of K would show: what is promised is agreement with the dense factorisation.
    """
    n, stencil = len(samples), samples.stencil
    assert isinstance(stencil, Stencil), "covariances of several kinds of samples have no such structure"
    density = stencil.spectral_density(prior.kernel)
    if density is None or (rung := samples.ladder.rung(density, _MOST_WAVES * n)) is None:
        return None
    m, largest = rung.waves, _AGREEMENT * samples.ladder.least_variance / (ROUNDING * math.sqrt(n))
    known = samples.ladder, rung, density, prior.noise_std**2, largest
    return Candidate(0.03 * m**3 + 6 * m**2 + n * m + 6e4, lambda: Fourier.of(*known))


def _structured(prior: Prior, samples: Samples, covariance: Covariance) -> Iterator[Candidate]:
    """Yield the factorisations that use structure of K, where rounding allows them.

    Errors η in the entries of K change weights, mean and gradients by about √n η/σ_n² (relative).
    """
    variances = noise_variance(prior, samples)
    assert isinstance(samples.stencil, Stencil), "covariances of several kinds of samples have no such structure"
    n, times, kernel, lags = len(samples), samples.times, prior.kernel, samples.stencil.lags
    span, gain = float(times[-1] - times[0]), sum(abs(rho) for rho, _ in lags)
    (variance,), _ = covariance(np.zeros(1))
    largest = gain * kernel(np.zeros(())).item()
    slope = largest / kernel.correlation_time  # |κ̇|² ≤ κ(0) |κ̈(0)| for every covariance
    if not (variance > 0 and np.isfinite(slope)):
        return
    tolerance = _AGREEMENT * float(np.min(variances)) / np.sqrt(n)
    allowed = tolerance if n <= LARGEST_DENSE else np.inf
    entries, lengths = _EPS * largest, _EPS * slope * span  # rounding of values, and of distances in time

    if entries <= allowed and np.isfinite(kernel.decay_distance):
        rows = blocks(times, reach(kernel, span, _NEGLIGIBLE * variance / gain) + abs(lags[-1][1]))
        if len(rows) > 2 and max(row.stop - row.start for row in rows) <= _LARGEST_BLOCK:
            yield Candidate(_cost_of_band(rows), partial(Band.of, times, rows, covariance, variances))

    if entries <= allowed and isinstance(kernel, Matern) and all(rho > 0 for rho, _ in lags):
        (decay,) = kernel.decays
        yield Candidate(800.0 * n + 6.5e5, partial(Markov.of, times, decay, lags, variances, _PRECISE))

    # Chebyshev points are computed for times from 0 on; shifting them to the first sample rounds them.
    moved = float(np.spacing(np.max(np.abs(times)))) if times[0] else 0.0
    placed = slope * moved <= (tolerance if n <= LARGEST_DENSE else _LOOSENED * tolerance)
    resolved = placed and kernel.is_analytic and ROUNDING * largest + lengths <= allowed
    if resolved and (m := samples.bases.points_for(covariance, n // 2)):
        known = samples.relative_noise, prior.noise_std**2
        cost = 0.2 * m**3 + 12 * m**2 + 4 * n * m + 0.01 * n * m**2 + 2e5  # a basis is used about ten times
        yield Candidate(cost, lambda: LowRank.of(samples.bases.of(m), covariance, *known))

    grid = Grid.of(times) if np.all(variances == variances[0]) else None
    if grid and entries + lengths + 2 * slope * grid.deviation <= allowed:
        yield Candidate(0.6 * n**2 + 500 * n + 6e5, partial(Toeplitz.of, grid, covariance, float(variances[0])))


def _cost_of_band(rows: list[slice]) -> float:
    own = np.array([row.stop - row.start for row in rows], dtype=float)
    after = np.append(own[1:], 0.0)
    return float(np.sum(0.06 * own**3 + 0.12 * own * after * (own + after) + 12 * own * (own + after) + 7.5e4))
