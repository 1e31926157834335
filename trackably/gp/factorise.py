"""Factorise K + V, the covariance of samples with noise, in the fastest way that is exact up to rounding.

- `Fourier`: few cosines and sines make a periodic kernel, and a smooth one that decays soon, such as the squared
  exponential. It is 5 times as fast as `Dense` for 300 samples, 10 times for 1,000: most references are learned so.
- `Quasiseparable` by tails (polynomials times e^(−λ|r|)): covariances with later samples pass through a small state.
  This is for Matérn kernels and sums of them. The time is linear in the number of samples: 7 times as fast as `Dense`
  for 1,000 samples, 30 times for 3,000, the only way for 100,000.
- `Quasiseparable` without tails: only samples in neighbouring blocks covary, if a kernel decays within a small part of
  the samples' span.
- `Dense`: the whole matrix, without any assumption, for up to `LARGEST_DENSE` samples.

The factorisations that apply are tried in the order of their speed. Where a dense matrix is possible, the others apply
only if their estimated difference from it is negligible; or small, by tails with many samples, where −2 ln p of a dense
matrix is no more exact. With less noise than that, only weights of a dense matrix solve (K + V) c = y in float64.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from trackably.arrays import Array
from trackably.gp.factors.dense import Dense
from trackably.gp.factors.factorisation import Factorisation
from trackably.gp.factors.fourier import Fourier
from trackably.gp.factors.quasiseparable import Quasiseparable, blocks, row_blocks
from trackably.gp.kernels.base import Decay
from trackably.gp.prior import Prior
from trackably.gp.rows import Terms
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencil

LARGEST_DENSE = 4000  # samples: a larger dense matrix takes gigabytes of memory and minutes of time
_LARGEST_MATRIX = 2**28  # entries (2 GiB) of the largest matrix that is built; a factorisation holds two of this size
# Tails, the terms of κ with a factor e^(−λ|r|), are used if λ times the time between the first and last instant of a
# sample is at most this. They are extrapolated backwards by this time, over which e^(−λ|r|) grows by e at most.
_WITHIN_A_LAG = 1.0
_BLOCK = 64  # smallest number of samples in a block of a `Quasiseparable` by tails
_LARGEST_BLOCK = LARGEST_DENSE // 2  # samples: `Quasiseparable` without tails is not used with a larger block
_FEWEST = 200  # samples: for fewer, the dense matrix is faster than looking for other structure
_FEWEST_OF_WAVES = 50  # samples: for fewer, the dense matrix is always faster
_MOST_WAVES = 0.65  # cosines and sines for each sample: with more, the dense matrix is faster
_PER_BLOCK = 4000  # entries of K for each block: with fewer, `Dense` is faster than `Quasiseparable` without tails
_MANY_BLOCKS = 20  # blocks: from here on, `Quasiseparable` without tails is faster than `Fourier`
_AGREEMENT = 3e-9  # largest estimated relative difference from `Dense`; below the promised 1e-8, as it is an estimate
_MANY, _NEARLY = 500, 1e-6  # samples, and a larger `_AGREEMENT` from there on for `Quasiseparable` by tails
_EPS = float(np.finfo(float).eps)
_ROUNDING = 4 * _EPS  # part of the largest covariance: smaller differences are not resolved


def noise_variance(prior: Prior, samples: Samples) -> Array:
    """Return the variance σ_n² ϱ_i² of the noise of each sample i, with relative noise ϱ_i; the shape is (n,)."""
    return np.asarray(prior.noise_std**2 * samples.relative_variance)


def terms_of(samples: Samples, origin: float = 0.0) -> Terms:
    """Return the terms of each sample, a weighted sum of values of the process; its offset is left out.

    Times [s] count from `origin`.
    """
    n, at = len(samples), samples.stencil.centres(samples.times - origin)
    return Terms(at, samples.stencil.spread(np.ones(n)), np.tile(np.arange(n), len(at) // n))


def factorise(prior: Prior, samples: Samples) -> Factorisation | None:
    """Factorise K + V, where K is the covariance of the samples; None if K + V is not positive definite in float64.

    ValueError: the samples are too many; if they are of several kinds (such as positions and velocities), this is the
    case above `LARGEST_DENSE`.
    """
    return next((factor for factor in candidates(prior, samples) if factor is not None), None)


def candidates(prior: Prior, samples: Samples) -> Iterator[Factorisation | None]:
    """Yield the factorisations of K + V that are exact up to rounding, the fastest first, each computed on demand.

    One is None if K + V is not positive definite in float64. ValueError: none fits into memory, or samples of several
    kinds (such as positions and velocities), for which only a dense matrix applies, are too many for it.
    """
    n, stencil, is_structured = len(samples), samples.stencil, False
    if isinstance(stencil, Stencil):
        for found in _structured_factorisations(prior, samples, stencil):
            is_structured = True
            yield found
    elif n > LARGEST_DENSE:
        raise ValueError(
            f"samples: {n} of {' and '.join(stencil.names)} are too many to learn from together; thin them out to "
            f"{LARGEST_DENSE}, or give samples of one kind only"
        )
    if not is_structured and n**2 > _LARGEST_MATRIX:
        raise ValueError(
            f"samples: {n} are too many for a correlation time of {prior.kernel.correlation_time:.3g} s within "
            f"{samples.ladder.span:.6g} s; thin them out to {math.isqrt(_LARGEST_MATRIX)}, or choose a Matérn kernel, "
            "whose memory grows with the number of samples"
        )
    if n <= LARGEST_DENSE or not is_structured:
        yield Dense.of(*samples.covariance(prior.kernel), noise_variance(prior, samples))


def _structured_factorisations(prior: Prior, samples: Samples, stencil: Stencil) -> Iterator[Factorisation | None]:
    """Yield the factorisations that use structure of K, the fastest first.

    Errors η in the entries of K change weights, mean and gradients by about √n η/σ_n² (relative). If a dense matrix is
    possible, these changes have to stay below `_AGREEMENT`, or below `_NEARLY` if there are many samples and κ is a sum
    of tails (polynomials times e^(−λ|r|)).
    """
    n, times, kernel = len(samples), samples.times, prior.kernel
    if n < _FEWEST_OF_WAVES:
        return
    variances = noise_variance(prior, samples)
    largest = sum(map(abs, stencil.weights)) ** 2 * kernel(np.zeros(())).item()  # at least every entry of K
    least = variances.min().item() / math.sqrt(n)

    def is_allowed(error: float, agreement: float = _AGREEMENT) -> bool:
        return n > LARGEST_DENSE or error <= agreement * least

    def of_blocks(rows: list[slice], tails: Sequence[Decay] = ()) -> Quasiseparable | None:
        terms = terms_of(samples, times[0])  # times since the first sample have the smallest rounding errors
        return Quasiseparable.of(
            row_blocks(terms, rows, tails, None if tails else kernel.value_and_gradient), variances
        )

    longest, tails, near = stencil.length, kernel.decays, list[slice]()
    is_resolved = n >= _FEWEST and is_allowed(_EPS * largest)
    is_nearly = is_resolved or (n >= _MANY and is_allowed(_EPS * largest, _NEARLY))
    if is_nearly and tails and max(tail.rate for tail in tails) * longest <= _WITHIN_A_LAG:
        yield of_blocks(blocks(times, longest, _BLOCK), tails)
    if is_resolved:
        near = blocks(times, kernel.negligible_distance + longest)
        if max(row.stop - row.start for row in near) > _LARGEST_BLOCK or len(near) > n**2 / _PER_BLOCK:
            near = []
    if len(near) >= _MANY_BLOCKS:
        yield of_blocks(near)

    noise, most = (samples.relative_noise, prior.noise_std**2), min(_MOST_WAVES * n, _LARGEST_MATRIX / n)
    # |κ̇|² ≤ κ(0) |κ̈(0)| for every covariance
    of_phases = _EPS * largest * samples.ladder.span / kernel.correlation_time if kernel.period else 0.0
    if is_allowed(_ROUNDING * largest + of_phases) and (waves := samples.ladder.waves(kernel, most)):
        yield Fourier.of(*noise, *waves)

    if 2 < len(near) < _MANY_BLOCKS:
        yield of_blocks(near)
