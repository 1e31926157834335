"""Differences of samples of Matérn processes: their covariance is a band matrix, computed to full relative precision.

Let κ(r) = P(x) e^(−x) with x = λ|r| and deg P = p − 1, that of a process with p − 1 derivatives. For t ≥ s, κ(t − s) is
a polynomial of degree p − 1 times e^(−λt). The divided difference of e^(λt) κ(t − s) over p + 1 times is therefore zero
if none of them lies before s. If some do, it is that of the jumps there: of what κ differs by from the function that
continues it from later times,

    P(−x) e^x − P(x) e^(−x) = O(x^(2p − 1)).

Samples y(t) = Σ_j w_j g(t + j h) have the covariance Σ ρ κ(t − t' + d): a sum of such functions, with their jumps.
"""

from math import factorial, prod
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.gp.kernels.moments import Decay

Numbers = npt.NDArray[Any]
"""Real or complex: imaginary parts hold derivatives."""

Lags = list[tuple[float, float]]
"""(ρ, d) with cov(y(t), y(t')) = Σ ρ κ(t − t' + d), d [s] increasing and symmetric about zero."""

_TERMS = 9  # of a series that is summed up to x = 1
_FARTHEST = 300.0  # as x: e^x is far from overflow


class Differenced(NamedTuple):
    """Samples y replaced by D y, D lower triangular with a diagonal of ones, and the `covariance` D K Dᵀ of these.

    Both as bands: row q holds the n − q entries of the q-th diagonal below the main one, then zeros.
    """

    differences: Numbers
    covariance: Numbers


def order(decay: Decay) -> int:
    """Return p, the number of times before its own that a difference sees."""
    return decay.polynomial.degree() + 1


def width(times: Array, p: int, lags: Lags) -> int:
    """Return the number of diagonals of D K Dᵀ below the main one."""
    reached = np.searchsorted(times, times[:-p] - lags[-1][1], side="right")
    return int(np.max(np.arange(p, len(times)) - reached))


def differenced(times: Array, decay: Decay, lags: Lags, stretch: complex = 1.0) -> Differenced:
    """Return D and D K Dᵀ for n increasing `times` [s], and the rate λ times `stretch`."""
    p, n, rate = order(decay), len(times), decay.rate * stretch
    polynomial = np.asarray(decay.polynomial.coef, dtype=float) / decay.rate ** np.arange(p)
    d = np.zeros((p + 1, n), dtype=np.result_type(stretch))  # D_{i, i−l} in column i of row l
    for i in range(p):
        d[: i + 1, i] = _difference(rate, [times[i - k] for k in range(i + 1)])
    d[:, p:] = _difference(rate, [times[p - k : n - k] for k in range(p + 1)])
    below = width(times, p, lags)
    jumps = _jumps(times, rate, polynomial, lags, range(-below, p + 1))
    mixed = np.zeros((below + 1, n), dtype=d.dtype)  # (D K)_{i, i−e} in column i of row e
    for e, of_lag in enumerate(mixed):
        for a in range(p + 1):
            of_lag[max(p, e) :] += d[a, max(p, e) :] * jumps[a - e][max(p, e) - a : n - a]
    covariance = np.zeros((max(below, p) + 1, n), dtype=d.dtype)
    for q in range(below + 1):
        for b in range(min(p, below - q) + 1):
            covariance[q, : n - q] += d[b, : n - q] * mixed[q + b, q:]
    first = np.array([[d[i - j, i] if j <= i else 0.0 for j in range(p)] for i in range(p)])
    of_first = first @ _among(times[:p], rate, polynomial, lags) @ first.T
    for q in range(p):
        covariance[q, : p - q] = of_first.diagonal(-q)
    return Differenced(np.array([np.append(row[lag:], row[:lag]) for lag, row in enumerate(d)]), covariance)


def cancelled(times: Array, decay: Decay, lags: Lags) -> float:
    """Return the factor by which rounding of e^x and of times may grow where large jumps cancel; or infinity.

    That is so beside long gaps, and where samples see more of the process than lies between them.
    """
    p, longest = order(decay), lags[-1][1]
    span = times[p:] - times[:-p]
    x = decay.rate * (span + longest)
    if not np.max(x) < _FARTHEST:
        return np.inf
    weights = np.abs(_difference(0.0, [times[p - k : len(times) - k] for k in range(p + 1)]))
    wide = (1 + longest / span) ** (2 * p - 1)
    return float(np.max(np.maximum(1.0, x) * weights * wide) * np.exp(decay.rate * longest))


def _difference(rate: complex, at: list[Array]) -> Numbers:
    """Return the weights of g at these times, the last one first, in the divided difference of e^(λt) g(t).

    That of g at the last time is 1. Shape (len(at), …).
    """
    last = at[0]
    scale = prod((last - t for t in at[1:]), start=np.ones(np.shape(last)))
    products = [prod((own - t for k, t in enumerate(at) if k != lag), start=1.0) for lag, own in enumerate(at)]
    return np.array([np.exp(-rate * (last - own)) * (scale / by) for own, by in zip(at, products, strict=True)])


def _among(times: Array, rate: complex, polynomial: Array, lags: Lags) -> Numbers:
    """Return the covariance matrix of samples at these times."""
    found = np.zeros((len(times), len(times)), dtype=np.result_type(rate))
    for ratio, lag in lags:
        x = rate * np.abs(times[:, None] - times + lag)
        found += ratio * np.polynomial.polynomial.polyval(x, polynomial) * np.exp(-x)
    return found


def _jumps(times: Array, rate: complex, polynomial: Array, lags: Lags, shifts: range) -> dict[int, Numbers]:
    """Return the jumps of the covariance of each sample with one `shift` later: (n,), zero where there is none."""
    found = {shift: np.zeros(len(times), dtype=np.result_type(rate)) for shift in shifts}
    own = {shift: slice(max(0, -shift), len(times) - max(0, shift)) for shift in shifts}
    pairs = [(shift, ratio, lag) for shift in shifts for ratio, lag in lags]
    apart = [
        times[own[shift].start + shift : own[shift].stop + shift] - times[own[shift]] - lag for shift, _, lag in pairs
    ]
    some = [k for k, of_pair in enumerate(apart) if np.max(of_pair) > 0]
    jumps = _jump(polynomial, rate * np.maximum(np.concatenate([apart[k] for k in some]), 0.0))
    for k, jump in zip(some, np.split(jumps, np.cumsum([len(apart[k]) for k in some])[:-1]), strict=True):
        shift, ratio, _ = pairs[k]
        found[shift][own[shift]] += ratio * jump
    return found


def _jump(polynomial: Array, x: Numbers) -> Numbers:
    """Return P(x) e^(−x) − P(−x) e^x, which is odd; its powers below 2p − 1 cancel."""
    p = len(polynomial)
    powers = range(2 * p - 1, 2 * (p + _TERMS), 2)
    series = [-2 * sum(c * (-1) ** k / factorial(n - k) for k, c in enumerate(polynomial.tolist())) for n in powers]
    value, small = np.polynomial.polynomial.polyval, x.real < 1.0
    near = value(x * x, series) * x ** (2 * p - 1)
    if small.all():
        return np.asarray(near)
    return np.where(small, near, value(x, polynomial) * np.exp(-x) - value(-x, polynomial) * np.exp(x))
