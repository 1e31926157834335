"""Matérn kernels at any times: products of band matrices.

With the differences D of samples (see `differences`),

    A = K + V = D⁻¹ B D⁻ᵀ,        B = D K Dᵀ + D V Dᵀ,        A⁻¹ = Dᵀ B⁻¹ D,        |A| = |B|.

B is a band matrix: solutions, determinant and gradient take linear time and memory. (H. Chen, L. Ding and R. Tuo:
Kernel packet: an exact and scalable algorithm for Gaussian process regression with Matérn correlations, J. Mach. Learn.
Res. 23 (2022), take differences on both sides of a sample, of twice as many times.) B is well-conditioned unless
samples are dense beside 1/λ. Derivatives are imaginary parts: all of it is computed for ln λ + i ε.
"""

from dataclasses import dataclass
from math import factorial, prod
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt
import scipy

from trackably.arrays import Array
from trackably.cached import cached
from trackably.gp.factors.factorisation import Factorisation
from trackably.gp.kernels.base import Decay

# Differences of samples of Matérn processes: their covariance is a band matrix, computed to full relative precision.
#
# Let κ(r) = P(x) e^(−x) with x = λ|r| and deg P = p − 1, that of a process with p − 1 derivatives. For t ≥ s, κ(t − s)
# is a polynomial of degree p − 1 times e^(−λt). The divided difference of e^(λt) κ(t − s) over p + 1 times is therefore
# zero if none of them lies before s. If some do, it is the divided difference of the jump at these times: of κ minus
# the continuation of κ from times after s,
#
#     P(−x) e^x − P(x) e^(−x) = O(x^(2p − 1)).
#
# Samples y(t) = Σ_j w_j g(t + j h) have the covariance Σ ρ κ(t − t' + d): a sum of such functions, with their jumps.

Numbers = npt.NDArray[Any]
"""Real or complex: imaginary parts hold derivatives."""

Lags = list[tuple[float, float]]
"""(ρ, d) with cov(y(t), y(t')) = Σ ρ κ(t − t' + d), d [s] increasing and symmetric about zero."""

_TERMS = 9  # of a series that is summed up to x = 1
_FARTHEST = 300.0  # as x: e^x is far from overflow


class Differenced(NamedTuple):
    """Samples y replaced by D y, where D is lower triangular with ones on its diagonal, and their `covariance` D K Dᵀ.

    Both are stored as bands: row q holds the n − q entries of the q-th diagonal below the main one, then zeros.
    """

    differences: Numbers
    covariance: Numbers


def order(decay: Decay) -> int:
    """Return p: a difference uses a sample and p earlier ones."""
    return decay.polynomial.degree() + 1


def width(times: Array, p: int, lags: Lags) -> int:
    """Return the number of diagonals of D K Dᵀ below the main one."""
    reached = np.searchsorted(times, times[:-p] - lags[-1][1], side="right")
    return int(np.max(np.arange(p, len(times)) - reached))


def difference(times: Array, decay: Decay, lags: Lags, stretch: complex = 1.0) -> Differenced:
    """Return D and D K Dᵀ for n increasing `times` [s], with the rate λ multiplied by `stretch`."""
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


def cancellation(times: Array, decay: Decay, lags: Lags) -> float:
    """Return the factor by which rounding errors of e^x and of times may grow when large jumps cancel; may be infinite.

    It is large next to long gaps, and if a sample depends on the process over a longer time than lies between samples.
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
    """Return the weights of g at these times, the last time first, in the divided difference of e^(λt) g(t).

    The weight of g at the last time is 1. Shape (len(at), …).
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
    """Return, for each shift, the jumps of the covariance of each sample with the sample `shift` places later.

    Shape (n,) each, with zeros where there is no such sample.
    """
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


# Symmetric band matrices, by their diagonals: row q holds the q-th one below the main one, then q zeros.


def plus(wider: Numbers, narrower: Numbers) -> Numbers:
    """Return the sum of two band matrices."""
    found = wider.astype(np.result_type(wider, narrower))
    found[: len(narrower)] += narrower
    return found


def congruent(lower: Numbers, diagonal: Array) -> Numbers:
    """Return L V Lᵀ for a `lower` triangular band matrix L and a `diagonal` matrix V (n,)."""
    order, n = len(lower) - 1, len(diagonal)
    found = np.zeros_like(lower)
    for q in range(order + 1):
        for lag in range(order + 1 - q):
            count = n - q - lag
            found[q, lag : n - q] += lower[q + lag, :count] * lower[lag, :count] * diagonal[:count]
    return found


def times_vector(matrix: Numbers, x: Numbers) -> Numbers:
    """Return B x for x (n,)."""
    found: Numbers = matrix[0] * x
    for q, beside in enumerate(matrix[1:], 1):
        found[q:] += beside[:-q] * x[:-q]
        found[:-q] += beside[:-q] * x[q:]
    return found


def condition(matrix: Array, factor: Array) -> float:
    """Return an estimate, from below, of ‖B‖₁ ‖B⁻¹‖₁ for B with its diagonal scaled to ones, given
    its Cholesky `factor`.

    W. W. Hager: Condition estimates. SIAM J. Sci. Stat. Comput. 5 (1984), 311–316.
    """
    n, scale = matrix.shape[1], np.sqrt(matrix[0])

    def solve_banded_rows(x: Array) -> Array:
        found, _ = scipy.linalg.lapack.dpbtrs(factor, (scale * x)[:, None], lower=True)
        return np.asarray(scale * found[:, 0])

    first = solve_banded_rows(np.full(n, 1 / n))
    worst = np.zeros(n)
    worst[np.argmax(np.abs(solve_banded_rows(np.where(first < 0, -1.0, 1.0))))] = 1.0
    inverse = max(np.abs(first).sum(), np.abs(solve_banded_rows(worst)).sum())
    beside = [np.max(np.abs(row[:-q]) / (scale[q:] * scale[:-q])) for q, row in enumerate(matrix[1:], 1)]
    return float((1 + 2 * sum(beside)) * inverse)


def log_determinant_slope(matrix: Numbers, step: float) -> float:
    """Return ∂ ln|B| from B + i `step` ∂B, as the imaginary parts of the pivots.

    Terms in `step`² are lost in rounding.
    """
    order, n = len(matrix) - 1, matrix.shape[1]
    entries = np.zeros((3 * order + 1, n), dtype=complex, order="F")  # `order` rows more than entries, for the pivoting
    entries[2 * order] = matrix[0]
    for q, row in enumerate(matrix[1:], 1):
        entries[2 * order + q, : n - q] = entries[2 * order - q, q:] = row[: n - q]
    factors, _, _ = scipy.linalg.lapack.zgbtrf(entries, order, order, overwrite_ab=True)
    pivots = factors[2 * order]
    return float(np.sum(pivots.imag / pivots.real) / step)


_EPS = float(np.finfo(float).eps)
_STEP = 1e-30  # ε: its square is lost in rounding
_WIDEST = 20  # diagonals: matrices with more are left to other factorisations
_AT_ONCE = 2**15  # numbers of right sides that stay in the cache


@dataclass(frozen=True)
class Markov(Factorisation):
    """The factorisation of A for noise variances (n,), by differences of samples: the Cholesky
    `factor` of the banded B.

    `stepped` are the differences for ln λ + i ε: imaginary parts divided by ε are derivatives by ln λ (complex step).
    The kernel has the hyperparameters θ₁, with κ ∝ θ₁², and θ₂ ∝ 1/λ.
    """

    noise_variance: Array
    stepped: Differenced
    factor: Array

    @classmethod
    def of(cls, times: Array, decay: Decay, lags: Lags, noise_variance: Array, largest_error: float) -> Self | None:
        """Factorise for n increasing `times` [s]; None if B is not positive definite in float64.

        None also if rounding may change solutions by more than `largest_error` (relative): times are dense compared
        with 1/λ, or some are much closer to each other than others.
        """
        if width(times, order(decay), lags) > _WIDEST or not _EPS * cancellation(times, decay, lags) <= largest_error:
            return None
        stepped = difference(times, decay, lags, 1 + 1j * _STEP)
        b = plus(stepped.covariance.real, congruent(stepped.differences.real, noise_variance))
        factor, info = scipy.linalg.lapack.dpbtrf(b, lower=True)
        if info or not _EPS * condition(b, factor) <= largest_error:
            return None
        return cls(noise_variance, stepped, factor)

    @cached
    def log_determinant(self) -> float:
        return 2 * float(np.sum(np.log(self.factor[0])))

    def solve(self, right: Array) -> Array:
        rows = np.atleast_2d(right.T)
        found, height = np.empty(rows.shape), max(1, _AT_ONCE // rows.shape[1])
        for first in range(0, len(rows), height):
            found[first : first + height] = self._solve(rows[first : first + height])
        return np.asarray(found.reshape(right.T.shape).T)

    def gradient_times(self, c: Array) -> Array:
        """Return 2 K c and ∂K/∂ln θ₂ c, shape (2, n), with K = D⁻¹ (D K Dᵀ) D⁻ᵀ."""
        d, covariance = self.stepped
        behind, _ = scipy.linalg.lapack.ztbtrs(d, c[:, None].astype(complex), uplo="L", trans="T")
        product = times_vector(covariance, behind[:, 0])
        found, _ = scipy.linalg.lapack.ztbtrs(d, product[:, None], uplo="L")
        return np.array([2 * found[:, 0].real, -found[:, 0].imag / _STEP])

    def likelihood_traces(self, c: Array) -> tuple[Array, float]:
        """Return the traces of `Factorisation`, from tr(A⁻¹ ∂A) = ∂ ln|B| and tr(A⁻¹ K) = n − tr(A⁻¹ V)."""
        d, covariance = self.stepped
        b = plus(covariance, congruent(d, self.noise_variance))
        by_noise = log_determinant_slope(
            plus(b.real, 1j * _STEP * congruent(self._differences, self.noise_variance)), _STEP
        )
        by_kernel = np.array([2 * (len(c) - by_noise), -log_determinant_slope(b, _STEP)])
        return by_kernel - self.gradient_times(c) @ c, float(by_noise - self.noise_variance @ c**2)

    def _solve(self, rows: Array) -> Array:
        """Return Dᵀ B⁻¹ D r for each r of the rows (m, n)."""
        d = self._differences
        along = rows.copy()
        for lag, weights in enumerate(d[1:], 1):
            along[:, lag:] += weights[:-lag] * rows[:, :-lag]
        kept, _ = scipy.linalg.lapack.dpbtrs(self.factor, along.T, lower=True)
        found: Array = kept.T.copy()
        for lag, weights in enumerate(d[1:], 1):
            found[:, :-lag] += weights[:-lag] * kept.T[:, lag:]
        return found

    @cached
    def _differences(self) -> Array:
        return np.ascontiguousarray(self.stepped.differences.real)
