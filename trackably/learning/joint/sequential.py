"""The function if bounded quantities are nonlinear formulas: sequential convex programs, from several starts.

At given times all formulas depend on the values v = L g of the signals g at finitely many instants. m⁺ and κ⁺ are the
posterior mean and covariance. With v = L m⁺ + W ξ and L κ⁺ Lᵀ = W Wᵀ, the function with these values that is nearest to
the posterior mean costs |ξ|². Under the bounds q_a ≥ b_a on formulas q_a, it solves

    min |ξ|²  subject to  q_a(L m⁺ + W ξ) ≥ b_a,

whose steps are convex programs: see `sqp`. A solution also solves the program with formulas linearised there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from typing import Self

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior, common_period
from trackably.gp.row_posterior import RowPosterior
from trackably.gp.rows import Rows, Terms
from trackably.gp.signal import KernelSum
from trackably.learning import sqp
from trackably.learning.constraint import Constraint, of_arguments, rows_of
from trackably.learning.index_set import RealTimes
from trackably.learning.joint.places import LOWER, UPPER, PlacedBounds, Places, merge, placed_bounds
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.intervals import Interval
from trackably.systems.trajectories import Quantity, Signals
from trackably.work import done

# Eigenvalues of a covariance count as rounding errors if they are at most the sum of two numbers: _WEAK times the
# largest eigenvalue, and _ROUNDING times the prior variance times the root of the number of eigenvalues.
_WEAK = 1e-11
_ROUNDING = 4 * float(np.finfo(float).eps)
# Part of the largest eigenvalue: when a search starts, components of ξ that belong to smaller eigenvalues are damped.
_FILTERED = 1e-6
_PRECISION = 1e-7  # relative to 1 + |ξ|²: a search ends when a step promises to lower |ξ|² by less
_RADIUS = 2.0  # the largest first step in each component of ξ
_MOST_STEPS = 60  # most steps of a search
_STRAY = 0.1  # part of a bound's width: a search near a function that keeps its bounds stays this close to them
_BROKEN = 1e-3  # part of a bound's width: a search that did not converge is accepted up to this violation


@dataclass(frozen=True)
class KnownValues:
    """A signal of which only the `values` at the increasing `times` [s] are known.

    It must be evaluated at these times only: at others, it returns the value at the next known time.
    """

    times: Array
    values: Array

    def __call__(self, t: Array) -> Array:
        return np.asarray(self.values[np.minimum(np.searchsorted(self.times, t), len(self.times) - 1)])


@dataclass(frozen=True)
class FormulaProgram:
    """min |ξ|² over ξ (k,) under `bounds` on formulas of the signals' values v = L m⁺ + W ξ at finitely many times.

    `times` has the times [s] for each process, P in all. `mean` is L m⁺ (P,), the posterior means at these instants,
    and `root` is W (P, k) with W Wᵀ their covariance. `arguments` (1 + k, N) has the N arguments of all formulas for
    the posterior means, and then their derivatives by ξ.
    """

    bounds: list[PlacedBounds]
    times: tuple[Array, ...]
    mean: Array
    root: Array
    arguments: Array

    @classmethod
    def of(cls, problem: ConstrainedProblem, posterior: JointPosterior, places: Places) -> Self:
        """Return the program for bounds at these `places` (times and sides).

        Raises IllConditioned if K + σ_n² I has no Cholesky factor.
        """
        bounds = placed_bounds(problem, places)
        asked = rows_of([(q, of.times) for of in bounds for _, q in of.trajectory.arguments], len(posterior.parts))
        times = tuple(np.unique(of.times) for of in asked.terms)
        first = list(accumulate(map(len, times), initial=0))
        terms = tuple(Terms(t, np.ones(len(t)), i + np.arange(len(t))) for t, i in zip(times, first, strict=False))
        given = RowPosterior(posterior, Rows(np.zeros(first[-1]), terms))
        blocks = [slice(*ends) for ends in pairwise(first)]  # one for each independent process
        largest = [part.prior.kernel(np.zeros(())).item() for part in posterior.parts]
        roots = [_root(given.covariance[of, of], k) for of, k in zip(blocks, largest, strict=True)]
        root = scipy.linalg.block_diag(*roots)
        values, arguments = np.column_stack([given.mean, root]), np.zeros((len(asked), 1 + root.shape[1]))
        arguments[:, 0] = asked.offsets
        for of, own, start in zip(asked.terms, times, first, strict=False):
            arguments += of.summed(values[start + np.searchsorted(own, of.times)], len(asked))
        return cls(bounds, times, given.mean, root, arguments.T)

    def minimiser_near(self, near: Signals) -> list[KnownValues] | None:
        """Return the signals' values at a local minimum, searched from the signals `near`; None if none is feasible."""
        start = np.concatenate([signal(t) for signal, t in zip(near, self.times, strict=True)]) - self.mean
        powers = np.sum(self.root**2, axis=0)  # the eigenvalues of W Wᵀ, as columns of W are orthogonal
        xi = (self.root / (powers + _FILTERED * np.max(powers, initial=0.0))).T @ start
        free = np.full(len(xi), np.inf)
        found = sqp.minimise(
            self._evaluate,
            xi,
            -free,
            free,
            _RADIUS,
            precision=_PRECISION,
            most_iterations=_MOST_STEPS,
            stray=_STRAY,
        )
        if found is None or not (found.converged or found.at.violation <= _BROKEN):
            return None
        parts = np.split(self.mean + self.root @ found.x, list(accumulate(map(len, self.times)))[:-1])
        return [KnownValues(times, values) for times, values in zip(self.times, parts, strict=True)]

    def _evaluate(self, xi: Array) -> sqp.Evaluation | None:
        """Return |ξ|² and the slacks, as parts of the bounds' widths, at ξ; None if a formula is undefined there."""
        done("evaluation")
        arguments = self.arguments.copy()
        arguments[0] += xi @ arguments[1:]
        ends = accumulate(len(of.trajectory.arguments) * len(of.times) for of in self.bounds)
        slacks = np.concatenate(list(map(_slacks, self.bounds, np.split(arguments, list(ends)[:-1], axis=1))), axis=1)
        if not np.isfinite(slacks).all():
            return None
        return sqp.Evaluation(float(xi @ xi), 2 * xi, slacks[0], slacks[1:].T, 2 * np.eye(len(xi)))


def _slacks(of: PlacedBounds, arguments: Array) -> Array:
    """Return the slacks of a bound at n times, relative to its width, and their derivatives: shape (1 + k, n).

    The first row has the slacks, and row i their derivatives by ξ_i. An equation counts as two bounds, an upper and a
    lower one: shape (1 + k, 2 n).
    """
    found = of.sides * of_arguments(of.trajectory, arguments)
    found[0] -= of.limits
    found /= of.width
    return np.concatenate([found, -found], axis=1) if of.is_equation else found


def _root(covariance: Array, largest: float) -> Array:
    """Return W with orthogonal columns and W Wᵀ = Σ.

    Columns are left out if they are only rounding errors of the `largest` prior variance.
    """
    powers, directions = np.linalg.eigh(covariance)
    kept = powers > _WEAK * np.max(powers, initial=0.0) + _ROUNDING * np.sqrt(len(powers)) * largest
    return np.asarray(directions[:, kept] * np.sqrt(powers[kept]))


_KNOTS, _FINE = 4, 2000  # knots of splines for each correlation time; points at which a path is computed
# Number of regular times at which bounds are imposed: in each correlation time; least and largest number in all.
_CLOSE, _FEWEST_REGULAR, _MOST_REGULAR = 8, 48, 100
_SLOWER = 0.5  # the slower motion keeps this part of the signals' distance from the prior means
# Part of a width: bounds keep this distance from a formula's value at rest, if it has no derivative there. With less
# distance, functions for the next hyperparameters often violate bounds between the times at which bounds are imposed.
_OFF = 0.05


def starts_for(problem: ConstrainedProblem, posterior: JointPosterior) -> list[Signals]:
    """Return sets of signals at which searches start: the posterior means, a slower motion, and an even motion.

    The slower motion has half the distance of the posterior means from the prior means. The even motion has the path of
    the posterior means, at constant speed: without stops and without fast stretches. If the posterior means are
    constant, only these are returned.
    """
    means = posterior.signals
    first, last, is_periodic = _span(problem, means)
    fine = np.linspace(first, last, _FINE)
    path = np.array([signal(fine) for signal in means])
    length = np.append(0.0, np.cumsum(np.sqrt(np.sum(np.diff(path, axis=1) ** 2, axis=0))))
    if not length[-1] > 0:
        return [means]
    even = (fine - first) / (last - first)
    count = _KNOTS * (last - first) / min(signal.kernel.correlation_time for signal in means)
    knots = np.linspace(first, last, int(np.clip(count, 8, _FINE / 4)))
    at = np.interp(np.interp(knots, fine, even), length / length[-1], fine)
    splines = [scipy.interpolate.CubicSpline(knots, signal(at)) for signal in means]
    slower = [_towards(signal.mean, signal) for signal in means]
    return [means, slower, [_along(spline, first, last, is_periodic) for spline in splines]]


def _along(spline: Callable[[Array], Array], first: float, last: float, is_periodic: bool) -> Callable[[Array], Array]:
    if is_periodic:
        return lambda t: np.asarray(spline(first + np.mod(t - first, last - first)))
    return lambda t: np.asarray(spline(np.clip(t, first, last)))


def _towards(level: float, signal: Callable[[Array], Array]) -> Callable[[Array], Array]:
    return lambda t: level + _SLOWER * (signal(t) - level)


def with_regular(problem: ConstrainedProblem, posterior: JointPosterior, places: Places) -> Places:
    """Return `places` (times and sides) with regular times added.

    With bounds at few times only, the solution could move to other local minima of the nonlinear program.
    """
    first, last, _ = _span(problem, posterior.signals)
    shortest = min(signal.kernel.correlation_time for signal in posterior.signals)
    count = int(np.clip(_CLOSE * (last - first) / shortest, _FEWEST_REGULAR, _MOST_REGULAR))
    regular = tuple(_regular(each, np.linspace(first, last, count)) for each in problem.constraints)
    return merge(places, regular, (last - first) / count / 2)


def _regular(constraint: Constraint, times: Array) -> Array:
    first, last = constraint.index_set.ends
    times = np.clip(constraint.index_set.nearest(times), first, last)
    return np.array([(time, side) for time in np.unique(times).tolist() for side in (LOWER, UPPER)]).reshape(-1, 2)


def _span(problem: ConstrainedProblem, signals: Sequence[KernelSum]) -> tuple[float, float, bool]:
    """Return the first and the last time [s] at which signals affect the bounds, and whether they span a period.

    If all signals have a common period, these times are 0 and the period.
    """
    if (period := common_period([signal.kernel for signal in signals])) is not None:
        return 0.0, period, True
    constraints = problem.constraints
    starts, ends = zip(*(each.index_set.ends for each in constraints), strict=True)
    arguments = [q for each in constraints for _, q in each.quantity.arguments]
    return min(starts), max(ends) + max(q.sampling_time * len(w) for q in arguments for w in q.weights), False


def with_backoff(problem: ConstrainedProblem, least: float) -> ConstrainedProblem:
    """Return the problem with bounds tightened by at least this part of their width."""
    constraints = (replace(each, backoff=max(each.backoff, least)) for each in problem.constraints)
    return replace(problem, constraints=tuple(constraints))


def tightening(problem: ConstrainedProblem, given: ConstrainedProblem) -> float:
    """Return by how much the bounds of `problem` are tighter than those of `given`: the largest difference.

    The result is a part of a bound's width, and includes the differences of back-offs. Of bounds that move in time,
    only the back-offs are compared.
    """
    pairs = zip(problem.constraints, given.constraints, strict=True)
    return max((_inward(ours, theirs) for ours, theirs in pairs), default=0.0)


def _inward(ours: Constraint, theirs: Constraint) -> float:
    own, other = ours.quantity.bounds, theirs.quantity.bounds
    moved = 0.0 if own.moving else max(own.lower - other.lower, other.upper - own.upper)
    return (moved / other.width if moved else 0.0) + ours.backoff - theirs.backoff


def keep_off_singularities(problem: ConstrainedProblem) -> ConstrainedProblem:
    """Return the problem with bounds moved inwards, off a formula's value at the prior means if it is not smooth there.

    Near a point without derivative (for example, where a vehicle stops), a function that is bounded at a few times may
    jump from one local minimum to another between these times.
    """
    levels = [part.mean for part in problem.prior.parts]
    return replace(problem, constraints=tuple(_keep_off_rest(each, levels) for each in problem.constraints))


def _keep_off_rest(constraint: Constraint, levels: Sequence[float]) -> Constraint:
    quantity, bounds = constraint.quantity, constraint.quantity.bounds
    if bounds.moving or is_smooth_at_rest(quantity, levels):
        return constraint
    rest, off = quantity.at_rest(levels), _OFF * bounds.width
    lower = max(bounds.lower, rest + off) if abs(rest - bounds.lower) < off else bounds.lower
    upper = min(bounds.upper, rest - off) if abs(rest - bounds.upper) < off else bounds.upper
    return replace(constraint, quantity=replace(quantity, bounds=Interval(lower, upper)))


def keep_off_short_times(problem: ConstrainedProblem) -> ConstrainedProblem:
    """Return the problem with a search space without length scales below two time steps.

    Bounds that cut off samples would favour such length scales, with signals that move between two steps as no input
    can make them move. Intervals that were given are kept, and all intervals if bounds hold at time steps only.
    """
    at_all_times = (c for c in problem.constraints if isinstance(c.index_set, RealTimes))
    steps = [q.sampling_time for each in at_all_times for _, q in each.quantity.arguments]
    least = SearchSpace.around(problem.samples, problem.prior, shortest=2 * min(steps, default=0.0)).bounds
    bounds = {
        name: Interval(max(sought.lower, min(least[name].lower, sought.upper)), sought.upper)
        for name, sought in problem.space.bounds.items()
    }
    return replace(problem, space=replace(problem.space, bounds=bounds))


def is_smooth_at_rest(quantity: Quantity, levels: Sequence[float]) -> bool:
    """Return whether the quantity has derivatives by its arguments if every signal c rests at `levels[c]`."""
    at = {name: np.asarray(of.at_rest(levels)) for name, of in quantity.arguments}
    return all(np.isfinite(slope).all() for slope in quantity.slopes(at).values())
