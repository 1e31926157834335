"""The function for given hyperparameters: the posterior mean, changed as little as bounds at some times require.

    g* = argmin { ‖y − S g‖²_{Σ⁻¹} + ‖g − m‖²_H  :  L_a g ≥ b_a for all a }   =   m⁺ + Σ_a λ_a κ⁺(·, L_a),

a convex program for samples y with noise covariance Σ, where S g are the values of g at the samples. A row L_a is a
linear functional of the signals, and b_a is its limit (for given values: L_a g = b_a). m and H are the prior's mean and
the Hilbert space of its kernel, m⁺, κ⁺ and H⁺ are the posterior's mean, kernel and Hilbert space, and λ are
multipliers. The minimum exceeds that of the posterior mean by D(θ) = min ‖g − m⁺‖²_{H⁺}. Where a bound is on a
formula of the signals (nonlinear plants), a sequence of convex programs is solved, and L_a is the linearisation of the
formula at the function with which the sequence ends.

A working set holds the rows whose bounds are active for some θ of a search. A search imposes bounds at hundreds of
times, and few bounds are active at once. The covariance of the rows in the working set is much smaller than that of all
rows, and the function for these rows is the function for all rows as soon as it violates no bound.
"""

from dataclasses import dataclass
from functools import cached_property as cached

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array, Flags
from trackably.gp.joint import JointPosterior
from trackably.gp.row_posterior import RowPosterior, has_system
from trackably.gp.signal import KernelSum
from trackably.learning.joint.dual import solve_dual, solve_symmetric, system_multipliers
from trackably.learning.joint.places import Demands, Places, demands
from trackably.learning.joint.sequential import FormulaProgram
from trackably.learning.problem import ActiveBound, ConstrainedProblem
from trackably.systems.trajectories import Signals
from trackably.work import done

_CORRECTIONS = 5  # most corrections of the multipliers of one function
_MISSED = 1e-9  # part of a width: a row that violates its bound by more is active, and joins the working set
_MET = 1e-10  # part of a width: corrections end at smaller residuals; the first back-off (tightening) is 1e-6
# Parts of the rows' variances, added to the diagonal of their covariance K⁺: tried in turn until a factor exists.
_JITTERS = 1e-12, 1e-10, 1e-8
_NEGLIGIBLE = 1e-6  # relative to the largest effect of an active bound: smaller effects are not listed
# Part of a width: rows whose values are further from their limit are left out of the linearised program.
_NEAR = 0.02


@dataclass(frozen=True)
class ConstrainedMean:
    """The function m⁺ + Σ_a λ_a κ⁺(·, L_a), with `multipliers` λ (r,) of r rows, and the `price` D(θ) of the bounds.

    A row L_a is a weighted sum of the function's values, for which a limit is `demanded`. `given` has the mean and the
    covariance of the rows, given the samples. If `contradicts` holds, no function meets all demands, and the rows with
    the largest `multipliers` contradict each other.
    """

    given: RowPosterior
    demanded: Demands
    multipliers: Array
    price: float
    contradicts: bool

    @property
    def posterior(self) -> JointPosterior:
        """The posterior without bounds, from which the function is derived."""
        return self.given.posterior

    @cached
    def signals(self) -> tuple[KernelSum, ...]:
        """The function as sums of kernels, corrected until the active bounds are met to 1e-10 of their width.

        There are at most 5 corrections, and none after one that does not halve the residual. Two approximations make a
        correction necessary: sums of kernels represent rows up to a small residual, and the multipliers are those of a
        covariance K⁺ whose diagonal is a little larger.
        """
        active = np.flatnonzero(self.multipliers)
        multipliers, least = self.multipliers.copy(), np.inf
        kept = found = self.given.signals(multipliers)
        for _ in range(_CORRECTIONS if len(active) else 0):
            missed = (self.demanded.limits - self.demanded.rows.values(found))[active]
            largest = float(np.max(np.abs(missed) / self.demanded.widths[active]))
            if not largest < least / 2:
                break
            kept, least = found, largest
            if largest <= _MET:
                break
            multipliers[active] += self._solve(missed)
            found = self.given.signals(multipliers)
        return kept

    def _solve(self, right: Array) -> Array:
        """Solve K⁺ x = r for r = `right` (m,), with the covariance K⁺ of the m active rows (linear functionals)."""
        active = np.flatnonzero(self.multipliers)
        if not self.given.system:
            return solve_symmetric(self.given.covariance[np.ix_(active, active)], right)
        solvers = (self.given.system.solver(self.multipliers != 0, part) for part in _JITTERS)
        solve = next(filter(None, solvers), None)
        return np.zeros(len(active)) if solve is None else solve(right)[0]

    @property
    def active_bounds(self) -> tuple[ActiveBound, ...]:
        """The bounds with λ_a ≠ 0, each with its cost λ_a (b_a − L_a m⁺) for the limit b_a of its row; the sum is D."""
        return tuple(self._active_bound(a) for a in np.flatnonzero(self.multipliers).tolist())

    @property
    def most_influential(self) -> tuple[ActiveBound, ...]:
        """The active bounds in decreasing order of their effect; those with a negligible effect are left out.

        The effect of a bound is the size of its multiplier times the posterior standard deviation of what is bounded.
        """
        moves = np.abs(self.multipliers) * np.sqrt(np.maximum(self.given.covariance.diagonal(), 0.0))
        by_size = np.argsort(-moves, kind="stable")
        return tuple(self._active_bound(a) for a in by_size.tolist() if moves[a] > _NEGLIGIBLE * np.max(moves))

    def _active_bound(self, a: int) -> ActiveBound:
        price = self.multipliers[a] * (self.demanded.limits[a] - self.given.mean[a])
        return ActiveBound(*self.demanded.label(a), self.multipliers[a].item(), price.item())

    @property
    def rise(self) -> float:
        """The derivative of the price D by ε, if all bounds move inwards by ε times their width."""
        moved = ~self.demanded.is_equation
        return float(2 * np.abs(self.multipliers[moved]) @ self.demanded.widths[moved])

    def price_gradient(self) -> Array:
        """Return the derivatives of the price D by the learned ln θ, shape (p,).

        By the envelope theorem, they are those for fixed multipliers and linearised formulas.
        """
        return self.given.price_gradient(self.multipliers)


def constrained_mean(
    problem: ConstrainedProblem,
    posterior: JointPosterior,
    places: Places,
    near: Signals | None = None,
    active: Places | None = None,
) -> ConstrainedMean | None:
    """Return the posterior mean with the smallest change that satisfies the bounds at these `places`.

    A place is a time and a side. If bounded quantities are nonlinear formulas, the result is a local minimum near the
    signals `near`, by default the posterior means; None if none is found. Giving the places whose bounds are probably
    `active` saves work. Raises IllConditioned if K + σ_n² I has no Cholesky factor.
    """
    at = posterior.signals if near is None else near
    if is_linear(problem):
        demanded = demands(problem, places, at)
    else:
        found = FormulaProgram.of(problem, posterior, places).minimiser_near(at)
        if found is None:
            return None
        every = demands(problem, places, found)
        is_near = every.rows.values(found) < every.limits + _NEAR * every.widths
        demanded = every.among(np.flatnonzero(is_near | every.is_equation))
    return mean_meeting(posterior, demanded, None if active is None else demanded.flags(active))


def is_linear(problem: ConstrainedProblem) -> bool:
    """Whether every bounded quantity is a linear functional of the signals, so that the program is convex."""
    return all(c.quantity.functional is not None for c in problem.constraints)


def mean_meeting(posterior: JointPosterior, demanded: Demands, likely: Flags | None = None) -> ConstrainedMean | None:
    """Return the posterior mean with the smallest change that meets the demands on r rows (linear functionals).

    None if the program cannot be solved in float64. The flags `likely`, shape (r,), mark rows that are probably active;
    they save work.
    """
    done("evaluation")
    given = RowPosterior(posterior, demanded.rows)
    gap = demanded.limits - given.mean
    if given.system and not demanded.is_equation.any():
        multipliers = system_multipliers(given.system, gap, _MISSED * demanded.widths, likely)
        if multipliers is not None:
            return ConstrainedMean(given, demanded, multipliers, float(multipliers @ gap), contradicts=False)
    dual = solve_dual(given.covariance, gap, demanded.is_equation, likely, given.rounding)
    if dual is None:
        return None
    return ConstrainedMean(given, demanded, dual.multipliers, dual.value, dual.contradicts)


_MAX_ROUNDS = 30  # most programs with the working set's rows only; then follows one with all rows


@dataclass
class WorkingSet:
    """The `demanded` limits of r rows (linear functionals), and flags (r,) of the rows that are `chosen` so far.

    Only chosen rows are in the programs. The set of chosen rows only grows, so that J stays smooth near a minimum. The
    search for active rows starts at the active rows of the last function. If equations of many rows are solved by a
    `RowSystem`, all rows are in the program; the chosen ones are then the active rows of the last function.
    """

    demanded: Demands
    chosen: Flags
    _active: Flags | None = None

    def mean_for(self, posterior: JointPosterior) -> ConstrainedMean | None:
        """Return the function that meets the `demanded` limits of all rows; None if float64 cannot compute it.

        Raises IllConditioned if K + σ_n² I has no Cholesky factor.
        """
        if has_system(posterior, len(self.chosen)):
            if found := mean_meeting(posterior, self.demanded, self._active):
                self._active = self.chosen = found.multipliers != 0
            return found
        for _ in range(_MAX_ROUNDS):
            rows = np.flatnonzero(self.chosen)
            likely = None if self._active is None else self._active[rows]
            found = mean_meeting(posterior, self.demanded.among(rows), likely)
            if found is None or found.contradicts:
                return found
            self._active = np.zeros_like(self.chosen)
            self._active[rows] = found.multipliers > 0
            added = self._misses(found)
            if not len(added):
                return found
            self.chosen[added] = True
        return mean_meeting(posterior, self.demanded)

    def _misses(self, found: ConstrainedMean) -> npt.NDArray[np.intp]:
        """Return the indices of rows that `found` violates and that are not chosen; of neighbours, only the worst."""
        values = self.demanded.rows.values(found.given.signals(found.multipliers))
        missed = (self.demanded.limits - values) / self.demanded.widths
        rows = np.flatnonzero((missed > _MISSED) & ~self.chosen)
        runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        return np.array([run[np.argmax(missed[run])] for run in runs if len(run)], dtype=np.intp)
