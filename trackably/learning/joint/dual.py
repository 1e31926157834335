"""The dual of the smallest change of a function that meets its bounds: a non-negative quadratic program.

    min ‖δ‖²  subject to  L_a δ ≥ d_a   is   max over λ ≥ 0 of  2 λᵀ d − λᵀ K λ,   with  K_ab = ⟨L_a, L_b⟩,

and δ = Σ_a λ_a L_a (representer theorem). The multiplier of an equation L_a δ = d_a may have any sign.

Many multipliers are positive at the maximum: block principal pivoting exchanges hundreds of them at once. It needs K
only to solve equations for some rows and to multiply, so that K is a matrix for few rows, and a `RowSystem` for many.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from trackably.arrays import Array, Flags
from trackably.gp.row_system import RowSystem
from trackably.learning.joint.interior import interior_multipliers
from trackably.work import done

_MOST_EXCHANGES, _MOST_STEPS = 60, 30  # most exchanges of blocks; most steps with single variables per variable
_PATIENCE = 3  # block exchanges allowed without a decrease of the number of variables with x < 0 or y < 0
_ROUNDING = 2 * float(np.finfo(float).eps)  # relative to Σ|x| + |b|: y = G x − b counts as zero above minus this
# For a system of many rows: the part of a row's variance that is added to the diagonal of K⁺; the part of the largest
# demand up to which active rows may miss theirs. Rows that contradict each other miss them by far more.
_SYSTEM_JITTER, _MET = 1e-13, 1e-6
_SMALL = 1e-6  # part of the largest multiplier of a system: smaller negative ones count as zero
_MOST_OF_SYSTEM = 20  # most exchanges for a system: an interior point method takes as long as so many


def nonnegative_minimum(G: Array, b: Array, likely: Flags | None = None) -> Array:
    """Return argmin xᵀ G x − 2 bᵀ x over x ≥ 0, shape (r,), for G (r, r) positive definite with a diagonal near 1.

    The search begins with the variables that are `likely` positive, flags of shape (r,). Raises LinAlgError if a
    submatrix has no Cholesky factor, and RuntimeError if the minimum is not found in float64.
    """

    def solve(positive: Flags) -> tuple[Array, Array]:
        x = np.zeros(len(b))
        _, x[positive], not_positive = scipy.linalg.lapack.dposv(G[positive][:, positive], b[positive], lower=1)
        if not_positive:
            raise np.linalg.LinAlgError("a submatrix of the dual program has no Cholesky factor in float64")
        return x, G @ x

    found = _pivot(solve, b, likely)
    return _by_single_steps(G, b) if found is None else found


def system_multipliers(system: RowSystem, demand: Array, tolerance: Array, likely: Flags | None = None) -> Array | None:
    """Return the λ ≥ 0 (r,) that maximise 2 λᵀ d − λᵀ K⁺ λ for d = `demand` (r,), where the `system` solves with K⁺.

    K⁺ is the posterior covariance of many rows, linear functionals of a function.

    Inactive rows may miss their demands by the `tolerance` (r,): rows whose multipliers are nearly zero would otherwise
    be exchanged to and fro. The search starts with the rows whose multipliers are `likely` to be positive, flags (r,).
    If it fails, an interior point method follows. None if λ is not found in float64.
    """
    scale = np.sqrt(system.variances)
    if not np.all(scale > 0):
        return None
    wanted = demand / scale

    def solve(positive: Flags) -> tuple[Array, Array]:
        if (solver := system.solver(positive, _SYSTEM_JITTER)) is None:
            raise np.linalg.LinAlgError("samples and active rows have no Cholesky factor in float64")
        x = np.zeros(len(demand))
        x[positive], products = solver(demand[positive])
        return x * scale, products / scale

    def misses(x: Array) -> bool:
        missed = np.abs(system.product(x / scale) / scale - wanted)[x != 0]
        return bool(np.any(missed > _MET * float(np.max(np.abs(wanted)))))

    try:
        found = _pivot(solve, wanted, likely, tolerance / scale, _SMALL, _MOST_OF_SYSTEM)
    except np.linalg.LinAlgError:
        found = None
    if found is None or misses(found):
        found = interior_multipliers(system, scale, wanted)
    return None if found is None else np.maximum(found, 0.0) / scale


def _pivot(
    solve: Callable[[Flags], tuple[Array, Array]],
    b: Array,
    likely: Flags | None,
    tolerance: Array | float = 0.0,
    small: float = 0.0,
    most: int = _MOST_EXCHANGES,
) -> Array | None:
    """Return the x ≥ 0 with y = G x − b ≥ 0 and xᵀ y = 0; None if it is not found within `most` exchanges.

    Block principal pivoting: the equations y = 0 are solved for the positive variables, and all variables with x < 0
    or y < 0 are exchanged together. If that does not help, single ones are exchanged (Júdice and Pires 1994: A block
    principal pivoting algorithm for large-scale strictly monotone linear complementarity problems, Computers and
    Operations Research 21). The first positive variables are those that are `likely` so. `solve` returns x for these
    positive variables, and G x. y counts as zero within the rounding error of G x, and within the
    `tolerance`; x counts as zero within the part `small` of its largest entry.
    """
    positive = np.zeros(len(b), dtype=bool) if likely is None else likely
    fewest, patience = len(b) + 1, _PATIENCE
    for _ in range(most):
        done("part")
        x, y = np.zeros(len(b)), -b
        if positive.any():
            x, products = solve(positive)
            y = products - b
        rounding = np.maximum(_ROUNDING * (np.abs(x).sum() + np.abs(b)), tolerance)
        wrong = np.where(positive, x < -small * np.max(x, initial=0.0), y < -rounding)
        count = int(np.count_nonzero(wrong))
        if not count:
            return x
        if count < fewest:
            fewest, patience = count, _PATIENCE
        elif patience:
            patience -= 1
        else:
            wrong[: np.flatnonzero(wrong)[-1]] = False
        positive = positive ^ wrong
    return None


def _by_single_steps(G: Array, b: Array) -> Array:
    """Return the minimiser by an active-set method that adds one positive variable in each step (Lawson and Hanson).

    It solves the least squares problem min ‖Rᵀ x − R⁻¹ b‖ with G = R Rᵀ: slower than block pivoting if many variables
    are positive, but it hardly ever fails.
    """
    R = scipy.linalg.cholesky(G, lower=True)
    found, _ = scipy.optimize.nnls(R.T, scipy.linalg.solve_triangular(R, b, lower=True), maxiter=_MOST_STEPS * len(b))
    return np.asarray(found)


# Bounds at neighbouring times have nearly dependent rows: this part of a row's variance is added to the diagonal of K.
_JITTER = 1e-12
# If K has no Cholesky factor, the part is 100 times as large, up to 1e-4; the program counts as not solvable then.
_JITTER_STEPS = 5
_WEAK = 1e-9  # relative to the largest eigenvalue: eigenvectors with smaller eigenvalues count as the null space
# If rows contradict each other, the dual value is about the squared residual divided by the jitter. Rows count as
# contradicting if a jitter that is _LARGER times as large lowers the dual value to less than _CHEAPER times the value.
_LARGER = 100.0
_CHEAPER = 0.1
_MISSED = 1e-7  # relative to the root of the dual value: with smaller residuals, rows do not contradict each other


@dataclass(frozen=True)
class DualSolution:
    """Multipliers λ (r,) of r rows (linear functionals) L_a, and the dual `value`.

    The value is a lower bound of ‖δ‖² for all functions δ with L_a δ ≥ d_a for each row a. If `contradicts` holds, no δ
    of reasonable size satisfies all these inequalities. λ is then a multiple of a dual ray, and the rows with the
    largest multipliers contradict each other.
    """

    multipliers: Array
    value: float
    contradicts: bool


def solve_dual(
    covariance: Array, demand: Array, is_equation: Flags, likely: Flags | None = None, rounding: Array | None = None
) -> DualSolution | None:
    """Return the λ that maximise 2 λᵀ d − λᵀ K λ, for the covariance K (r, r) of the rows and d = `demand` (r,).

    λ ≥ 0 except where `is_equation` holds. None if K is not positive semidefinite up to rounding. The search starts
    with the rows whose multipliers are `likely` to be positive. Flags have shape (r,). `rounding` (r,) has rounding
    errors of the variances, which differ between rows: if K has no Cholesky factor, they are added to its diagonal
    first, and a common jitter only if that is not enough, because a jitter softens exact rows as much as inexact ones.
    """
    scale = _norms(covariance)
    scaled, wanted = covariance / np.outer(scale, scale), demand / scale
    of_rows = [] if rounding is None else [_JITTER + rounding / scale**2]
    larger = np.arange(_JITTER_STEPS)
    for jitter in (_JITTER, *of_rows, *(_JITTER * _LARGER ** larger[1:])):
        diagonal = np.broadcast_to(jitter, wanted.shape)
        if (found := _solve(scaled + np.diag(diagonal), wanted, is_equation, likely)) is not None:
            value = float(found @ wanted)
            contradicts = _contradicts(scaled, wanted, is_equation, diagonal, found)
            return DualSolution(found / scale, value, contradicts)
    return None


def solve_symmetric(covariance: Array, right: Array) -> Array:
    """Solve K x = r for the `covariance` K of a few rows and r = `right`; x has no part in the null space of K."""
    scale = _norms(covariance)
    scaled = covariance / np.outer(scale, scale)
    powers, directions = np.linalg.eigh(scaled)
    strong = powers > _WEAK * powers[-1]
    along = directions[:, strong]
    return np.asarray(along @ (along.T @ (right / scale) / powers[strong]) / scale)


def _norms(covariance: Array) -> Array:
    """Return the square roots of the rows' variances (r,), and 1 for rows without variance.

    A row without variance has the same value for every δ: either every δ satisfies its inequality, or none does.
    """
    norms = np.sqrt(np.maximum(covariance.diagonal(), 0.0))
    return np.where(norms > 0, norms, 1.0)


def _contradicts(K: Array, d: Array, is_equation: Flags, jitter: Array, found: Array) -> bool:
    """Whether the multipliers `found` (r,) show that no δ has L_i δ ≥ d_i, or = d_i where `is_equation`, for all rows.

    K (r, r) is the covariance of the rows, to whose diagonal this `jitter` (r,) was added. If rows contradict each
    other, only the jitter bounds the dual value Σ_i λ_i d_i, which then falls much if the jitter is larger.
    """
    value = float(found @ d)
    if np.max(jitter * np.abs(found), initial=0.0) <= _MISSED * np.sqrt(max(value, 0.0)):
        return False
    coarser = _solve(K + _LARGER * np.diag(jitter), d, is_equation, found > 0)
    return coarser is not None and float(coarser @ d) < _CHEAPER * value


def _solve(K: Array, d: Array, is_equation: Flags, likely: Flags | None) -> Array | None:
    """Return λ as `solve_dual` for a positive definite K; None if K has no Cholesky factor or no λ is found."""
    try:
        return _eliminate(K, d, is_equation, likely) if is_equation.any() else nonnegative_minimum(K, d, likely)
    except (np.linalg.LinAlgError, RuntimeError):  # no Cholesky factor, or no minimum found
        return None


def _eliminate(K: Array, d: Array, is_equation: Flags, likely: Flags | None) -> Array:
    """Return the multipliers that maximise 2 λᵀ d − λᵀ K λ, λ ≥ 0 except for the rows that are equations.

    The equations are eliminated, and the smaller program of the other rows is solved.
    """
    free, bounded, found = np.flatnonzero(is_equation), np.flatnonzero(~is_equation), np.zeros(len(d))
    factor, beside = scipy.linalg.cho_factor(K[np.ix_(free, free)], lower=True), K[np.ix_(free, bounded)]
    across, alone = scipy.linalg.cho_solve(factor, beside), scipy.linalg.cho_solve(factor, d[free])
    left, begun = K[np.ix_(bounded, bounded)] - beside.T @ across, None if likely is None else likely[bounded]
    found[bounded] = nonnegative_minimum(left, d[bounded] - alone @ beside, begun)
    found[free] = alone - across @ found[bounded]
    return found
