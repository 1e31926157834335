"""Sums of kernels with regular centres at regular times: one convolution, if the two spacings are commensurate."""

from fractions import Fraction

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.factors.grid import Grid
from trackably.gp.kernels.base import Kernel

_FINEST = 100  # the largest denominator of the ratio of spacings
_COST = 60  # terms of the sum that take as long as one point of the transforms


def convolved(kernel: Kernel, centres: Array, weights: Array, t: Array, order: int) -> Array | None:
    """Return Σ_i c_i κ⁽ⁿ⁾(t − t_i) for n = 0 … order at increasing times t [s]: shape (order + 1, *t.shape).

    None unless times and centres lie on grids, up to rounding, whose steps are p h and q h with whole numbers p and q,
    and the convolution takes less time than the sum. On a common grid of step h, with zeros between the weights, the
    lag from centre i to time j is that from the first centre to the first time, plus (j p − i q) h.
    """
    if (of := Grid.of(centres)) is None or (at := Grid.of(t)) is None or not (of.is_exact and at.is_exact):
        return None
    ratio = Fraction(at.step / of.step).limit_denominator(_FINEST)
    p, q = ratio.numerator, ratio.denominator
    if p == 0 or abs(at.step * q - of.step * p) * at.count > q * (at.rounding + of.rounding):
        return None
    first, last = -(of.count - 1) * q, (at.count - 1) * p
    length = int(scipy.fft.next_fast_len(last - first + 1, real=True))
    if _COST * length > at.count * of.count:
        return None
    lags = at.start - of.start + of.step / q * np.arange(first, last + 1, dtype=float)
    spread = np.zeros(last - first + 1)
    spread[: -first + 1 : q] = weights
    # Lags begin at `first`, so that entry j p − first of the convolution is the sum for time j. Circular wrap-around
    # corrupts only entries before these.
    spectrum = scipy.fft.rfft(kernel.jet(lags, order), length) * scipy.fft.rfft(spread, length)
    return np.asarray(scipy.fft.irfft(spectrum, length)[:, -first : last - first + 1 : p])
