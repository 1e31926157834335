"""Factorise K + V in the fastest way that is exact up to rounding.

Four ways are tried, in the order of their estimated cost; all but the last one only where they agree with it:

- `Fourier`: few cosines and sines make a kernel whose spectral density decays fast, such as the squared exponential.
  It is 6 times as fast as `Dense` for 300 samples, 10 times for 1,000: most references are learned with it;
- `Quasiseparable`: covariances with later samples pass through a small state, for Matérn kernels and sums of them.
  Where a kernel decays within a small part of the samples' span, only neighbours are correlated. Time is linear: it is
  7 times as fast as `Dense` for 1,000 samples, 30 times for 3,000, and the only way for 100,000;
- `LowRank`: few Chebyshev points resolve a smooth kernel without such a density, for example a periodic one. It is 30
  times as fast as `Dense` for 1,500 samples, and its points are the centres of `Fourier`, too;
- `Dense`: the whole matrix, without any assumption, for up to `LARGEST_DENSE` samples.
"""

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from trackably.arrays import Array
from trackably.gp.factors.dense import Dense
from trackably.gp.factors.factorisation import Covariance, Factorisation
from trackably.gp.factors.fourier import Fourier
from trackably.gp.factors.low_rank import ROUNDING, Basis, LowRank
from trackably.gp.factors.quasiseparable import Cut, Quasiseparable, blocks, reach, tails
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencil, Stencils

LARGEST_DENSE = 4000  # samples: a larger dense matrix takes gigabytes of memory and minutes of time
_LARGEST_MATRIX = 2**28  # entries: 2 GiB, of which a factorisation holds two
_WITHIN_A_LAG = 1.0  # as λ times a lag: covariances of tails and of samples within lags differ by e^λ
_BLOCK = 64  # samples
_LARGEST_BLOCK = LARGEST_DENSE // 2
_FEWEST = 200  # samples: for fewer, the dense matrix is faster than looking for structure
_FEWEST_OF_WAVES = 50  # samples: for fewer, the dense matrix is always faster
_MOST_WAVES = 0.65  # for each sample: with more, the dense matrix is faster
_COST_OF_LOOKING = 5e5  # nanoseconds: one half for the search for other structure, one for the fastest other way
_NEGLIGIBLE = 2.0**-53  # relative to the variance: a smaller addition to a diagonal entry is lost in rounding
_AGREEMENT = 3e-9  # relative, with the dense factorisation: less than the promised 1e-8, as errors are only estimated
_LOOSENED = 1e3  # the factor by which the agreement is loosened where a dense matrix would be too large
_EPS = float(np.finfo(float).eps)


def noise_variance(prior: Prior, samples: Samples) -> Array:
    """Return σ_n² ϱ_i² of each sample i, shape (n,)."""
    return np.asarray(prior.noise_std**2 * samples.relative_variance)


def factorise_kinds(prior: Prior, samples: Samples, stencils: Stencils) -> Factorisation | None:
    """Factorise K + V of samples of several kinds; None as in `factorise`.

    ValueError: too many samples for a dense matrix.
    """
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
    fast = waves(prior, samples, covariance) if len(samples) >= _FEWEST_OF_WAVES else None
    if len(samples) < _FEWEST:
        return (fast and fast.compute()) or dense_factorisation(prior, samples, covariance)
    if fast and fast.cost < _COST_OF_LOOKING and (factor := fast.compute()):
        return factor
    found = (each.compute() for each in sorted(candidates(prior, samples, covariance), key=lambda each: each.cost))
    return next((factor for factor in found if factor is not None), None)


def dense_factorisation(prior: Prior, samples: Samples, covariance: Covariance) -> Dense | None:
    """Factorise K + V as a dense matrix; None as in `factorise`."""
    return Dense.of(lambda part: covariance(samples.apart[part]), noise_variance(prior, samples))


def candidates(prior: Prior, samples: Samples, covariance: Covariance) -> list[Candidate]:
    """Return all factorisations that are exact up to rounding.

    Their costs were measured on one machine; only their order matters. ValueError: none fits into memory.
    """
    n, found = len(samples), list(_structured_factorisations(prior, samples, covariance))
    if not found and n**2 > _LARGEST_MATRIX:
        raise ValueError(
            f"samples: {n} are too many for a correlation time of {prior.kernel.correlation_time:.3g} s within "
            f"{samples.ladder.span:.6g} s; thin them out to {math.isqrt(_LARGEST_MATRIX)}, or choose a Matérn kernel, "
            "whose memory grows with the number of samples"
        )
    if n <= LARGEST_DENSE or not found:
        found.append(Candidate(0.025 * n**3 + 8 * n**2, partial(dense_factorisation, prior, samples, covariance)))
    return found


def _within_memory(columns: float, n: int) -> float:
    """Return so many columns of n samples, or as many as fit into memory."""
    return min(columns, _LARGEST_MATRIX / n)


def waves(prior: Prior, samples: Samples, covariance: Covariance) -> Candidate | None:
    """Return the factorisation in cosines and sines; None if it would need too many of them, compared with the samples.

    None also if rounding errors in K would make it disagree with the dense factorisation.
    """
    n, stencil, noise = len(samples), samples.stencil, prior.noise_std**2
    assert isinstance(stencil, Stencil), "covariances of several kinds of samples have no such structure"
    density = stencil.spectral_density(prior.kernel)
    if density is None or (rung := samples.ladder.rung(density, _within_memory(_MOST_WAVES * n, n))) is None:
        return None
    least = noise * samples.ladder.least_variance
    if n <= LARGEST_DENSE and not ROUNDING * density.largest * math.sqrt(n) <= _AGREEMENT * least:
        return None
    m, basis = rung.waves, partial(_basis, prior, samples, covariance)
    cost = 0.03 * m**3 + 6 * m**2 + 3 * n * m + 0.01 * n * m**2 + 6e4  # waves are used about ten times
    return Candidate(cost, partial(Fourier.of, samples.ladder, rung, density, noise, basis))


class _Rounding(NamedTuple):
    """Estimated rounding errors of the covariances, and the `allowed` error.

    Errors η in the entries of K change weights, mean and gradients by about √n η/σ_n² (relative); they have to stay
    below `tolerance`. Entries of K are at most `largest`, and change by at most `slope` per second.
    """

    largest: float
    slope: float
    tolerance: float
    allowed: float

    @classmethod
    def of(cls, prior: Prior, samples: Samples) -> "_Rounding":
        n, stencil, kernel = len(samples), samples.stencil, prior.kernel
        assert isinstance(stencil, Stencil), "covariances of several kinds of samples have no such structure"
        largest = stencil.largest_gain * kernel(np.zeros(())).item()
        slope = largest / kernel.correlation_time  # |κ̇|² ≤ κ(0) |κ̈(0)| for every covariance
        tolerance = _AGREEMENT * float(np.min(noise_variance(prior, samples))) / np.sqrt(n)
        return cls(largest, slope, tolerance, tolerance if n <= LARGEST_DENSE else np.inf)

    @property
    def entries(self) -> float:
        """The rounding error of the values of κ."""
        return _EPS * self.largest

    def lengths(self, span: float) -> float:
        """Return the error of κ by rounding of time differences up to `span` [s]."""
        return _EPS * self.slope * span


def _points(prior: Prior, samples: Samples, covariance: Covariance) -> int | None:
    """Return the number of Chebyshev points that resolve the covariance.

    None if n/2 are too few, or rounding is too large.
    """
    rounding, n, times = _Rounding.of(prior, samples), len(samples), samples.times
    # Chebyshev points are computed for times from 0 on; shifting them to the first sample rounds them.
    moved = float(np.spacing(np.max(np.abs(times)))) if times[0] else 0.0
    placed = rounding.slope * moved <= rounding.tolerance * (1 if n <= LARGEST_DENSE else _LOOSENED)
    error = ROUNDING * rounding.largest + rounding.lengths(samples.bases.span)
    resolved = placed and prior.kernel.is_analytic and error <= rounding.allowed
    return samples.bases.points_for(covariance, int(_within_memory(n / 2, n))) if resolved else None


def _basis(prior: Prior, samples: Samples, covariance: Covariance) -> Basis | None:
    """Return the basis of few points if there are many samples, so that sums of kernels have few terms.

    Otherwise None.
    """
    count = _points(prior, samples, covariance) if len(samples) >= _FEWEST else None
    return samples.bases.of(count) if count else None


def _structured_factorisations(prior: Prior, samples: Samples, covariance: Covariance) -> Iterator[Candidate]:
    """Yield the factorisations that use structure of K, if their rounding errors are allowed."""
    variances, rounding = noise_variance(prior, samples), _Rounding.of(prior, samples)
    assert isinstance(samples.stencil, Stencil), "covariances of several kinds of samples have no such structure"
    n, times, kernel, lags = len(samples), samples.times, prior.kernel, samples.stencil.lags
    (variance,), _ = covariance(np.zeros(1))
    if not (variance > 0 and np.isfinite(rounding.slope)):
        return

    if spectral := waves(prior, samples, covariance):
        yield spectral

    longest, far = lags[-1][1], tails(kernel, lags)
    if rounding.entries <= rounding.allowed and far and max(tail.rate for tail in far) * longest <= _WITHIN_A_LAG:
        cut = Cut(blocks(times, longest, _BLOCK), far, longest > 0)
        yield Candidate(cut.cost, partial(Quasiseparable.of, times, cut, covariance, variances))

    if rounding.entries <= rounding.allowed and math.isfinite(kernel.decay_distance):
        negligible = _NEGLIGIBLE * variance / samples.stencil.largest_gain
        cut = Cut(blocks(times, reach(kernel, samples.bases.span, negligible) + longest), [], True)
        if len(cut.rows) > 2 and max(row.stop - row.start for row in cut.rows) <= _LARGEST_BLOCK:
            yield Candidate(cut.cost, partial(Quasiseparable.of, times, cut, covariance, variances))

    if m := _points(prior, samples, covariance):
        known = samples.relative_noise, prior.noise_std**2
        cost = 0.2 * m**3 + 12 * m**2 + 4 * n * m + 0.01 * n * m**2 + 2e5  # a basis is used about ten times
        yield Candidate(cost, lambda: LowRank.of(samples.bases.of(m), covariance, *known))
