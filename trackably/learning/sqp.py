"""Sequential quadratic programming for a few variables and any number of smooth inequality constraints.

minimise f(x) subject to g(x) ≥ 0 inside a box, by Fletcher's exact-penalty trust-region method: each step solves

    min ½ dᵀ B d + ∇fᵀ d + ρ (s + s²/2)   subject to   g + J d + s ≥ 0,   s ≥ 0,   x + d in the box,   |d| ≤ Δ,

which is always feasible. One slack s for all constraints gives the merit f + ρ (v + v²/2) with v = max(0, −min g): an
exact penalty, because its slope in v is at least ρ. So a start may violate any constraint, and if no point satisfies
them, the method still ends at a local minimum of the violation. If the penalty grew far beyond the multipliers, steps
along curved constraints would be tiny: it is then lowered at a point that satisfies all constraints, a few times at
most. The merit at such a point is f, whatever the penalty.

B is a quasi-Newton approximation of the Lagrangian's Hessian. If f has an `information`, as likelihoods do, B starts
from it, and returns to it whenever it predicts the last step better.

Each step's program is solved by its dual. With c = ∇f, z = (d, s), H = diag(B, ρ) = L Lᵀ, h = (c, ρ) and y = Lᵀ z + L⁻¹
h it asks for the shortest y in a polyhedron. Few rows are active, mostly those of the last program.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property as cached
from typing import NamedTuple, Self

import numpy as np
import scipy

from trackably.arrays import Array, Flags
from trackably.work import done

FEASIBLE = 1e-12  # violations up to this count as none
_AT_ONCE = 20  # most violated rows that join a program at once: of all violated rows, few are active in the end
_PIVOTS = 100  # most steps for each row of a quadratic program: SciPy's default 3 is too few if bounds nearly coincide


class QuadraticProgram(NamedTuple):
    """min ½ dᵀ B d + cᵀ d + ρ (s + s²/2) subject to g + J d + s ≥ 0 and s ≥ 0, for a step d (p,) and a slack s.

    B is factored once, and the program is solved for several g (m,) and ρ. The step is limited to the box from `lower`
    to `upper` (p,). `rows` (1 + m + 2p, p) has zeros for s ≥ 0, J, and I and −I for the ends of the box. `inverse` is
    the inverse of the Cholesky factor of B, and `shift` is its product with c. The flags `active` (2, 1 + m + 2p) mark
    rows that are probably active; each solution replaces them by the rows that are active in it. The first row of flags
    is for usual penalties ρ, the second for the largest ρ, with which many other rows are active.
    """

    rows: Array
    lower: Array
    upper: Array
    inverse: Array
    shift: Array
    active: Flags

    @classmethod
    def of(
        cls, curvature: Array, gradient: Array, jacobian: Array, lower: Array, upper: Array, active: Flags
    ) -> Self | None:
        """Return the program with the Hessian B = `curvature` and with c = `gradient`.

        Return None if B is not positive definite, as rounding may leave it after updates in nearly flat directions.
        """
        root, info = scipy.linalg.lapack.dpotrf(curvature, lower=True)
        if info:
            return None
        inverse, _ = scipy.linalg.lapack.dtrtri(root, lower=True)
        ends = np.eye(len(gradient))
        rows = np.concatenate([0 * ends[:1], jacobian, ends, -ends])
        return cls(rows, lower, upper, inverse, inverse.dot(gradient), active)

    def solve(self, slack: Array, penalty: float) -> tuple[Array, Array]:
        """Return the step d and the constraints' multipliers for g = `slack` and ρ = `penalty`.

        The dual has variables for the rows that are probably active. The rows that its solution violates most are added
        until no row is violated.
        """
        count, active = 1 + len(slack), self.active[int(penalty >= _LARGEST_PENALTY)]  # s is in the first `count` rows
        limits = np.concatenate([[0.0], slack, -self.lower, self.upper])
        chosen, multipliers = active.copy(), np.zeros(len(limits))
        chosen[0] = True
        while True:
            done("part")
            held = chosen.nonzero()[0]
            has_s, normals = held < count, self.inverse.dot(self.rows[held].T)
            offsets = has_s - limits[held] + self.shift.dot(normals)
            u = _of_the_shortest(np.vstack([normals, has_s * penalty**-0.5, offsets]))
            d = (normals.dot(u) - self.shift).dot(self.inverse)
            room = limits + self.rows.dot(d)
            if u[0] == 0:
                room[:count] += u[has_s].sum() / penalty - 1.0  # s
            missed = ((room < -FEASIBLE) & ~chosen).nonzero()[0]
            if not len(missed):
                break
            chosen[missed[room[missed].argsort()[:_AT_ONCE]]] = True
        multipliers[held] = u
        np.greater(multipliers, 0, out=active)
        if u[0] > 0 and room.min() < -FEASIBLE:
            # s ≥ 0 is active, thus s = 0: rounding errors in flat directions violate rows, whatever the penalty.
            move, *_ = np.linalg.lstsq(normals[:, u > 0].T, -room[active])
            d += move.dot(self.inverse)
        return np.minimum(np.maximum(d, self.lower), self.upper), multipliers[1:count]

    def least_violation(self, slack: Array, multipliers: Array) -> float:
        """Return a lower bound of the violation max(0, −min (g + J d)) after any step d in the box, for g = `slack`.

        It is the least violation of a mean of the constraints, weighted by their `multipliers` ≥ 0 (weak duality).
        """
        weights = multipliers / max(multipliers.sum(), 1.0)
        slope = weights.dot(self.rows[1 : 1 + len(slack)])
        return max(0.0, -float(weights.dot(slack) + np.maximum(slope * self.lower, slope * self.upper).sum()))


def _of_the_shortest(polyhedron: Array) -> Array:
    """Return u ≥ 0 such that y = N u is the shortest y with Nᵀ y ≥ b, from (N; bᵀ). The row bᵀ is overwritten.

    u follows from the residual of min ‖(N; bᵀ) u − (0; 1)‖ over u ≥ 0 (Lawson and Hanson).
    """
    offsets, unit = polyhedron[-1], np.zeros(len(polyhedron))
    unit[-1] = 1.0
    scale = max(1.0, np.abs(offsets).max().item())
    offsets /= scale  # y in units of `scale`, so that numbers are near 1
    u, _ = scipy.optimize.nnls(polyhedron, unit, maxiter=_PIVOTS * offsets.size)
    return np.asarray(u * (scale / (1.0 - offsets.dot(u))))


_MAX_ITERATIONS, _STEP_TOLERANCE = 1000, 1e-10  # most steps of a search; size below which a step counts as zero
PRECISION = 1e-15  # relative to 1 + |f|: a search ends when a step promises to gain less
_ROUNDING = 1e-10  # smaller violations count as zero: a tenth of the usual back-off (tightening) of bounds
FIRST_RADIUS, _LARGEST_RADIUS, _SMALLEST_RADIUS = 0.5, 4.0, 1e-13  # of the trust region; a search ends at the smallest
# First and largest penalty ρ; a step has to remove the part _STEERED of the violation that any step can remove.
_FIRST_PENALTY, _LARGEST_PENALTY, _STEERED = 1e2, 1e9, 0.5
# A large penalty makes steps along curved bounds tiny. It is lowered to _ENOUGH times the sum of the multipliers, but
# not below the first penalty, and at most _MOST_REDUCTIONS times.
_ENOUGH, _MOST_REDUCTIONS = 10.0, 5
_RIDGE = 1e-10  # this part of the trace of B is added to its diagonal: it limits the condition number of B

GiveUp = Callable[[Array, float, float], bool]
"""A function of (x, merit, gain) that decides whether a search is given up at x. `gain` is the decrease of the merit by
the last step or its prediction for the next step, whichever is larger. It is called after each step that the trust
region did not shorten, if the penalty did not change."""


def never(x: Array, merit: float, gain: float) -> bool:
    """Return False: for searches that are never given up."""
    return False


@dataclass(frozen=True)
class Evaluation:
    """The objective f, its gradient (p,), the slacks g (m,) of constraints g ≥ 0, and their Jacobian (m, p) at a point.

    `information` (p, p) is a positive semi-definite approximation of the Hessian of f; None if there is none.
    """

    value: float
    gradient: Array
    slack: Array
    jacobian: Array
    information: Array | None = None

    @cached
    def violation(self) -> float:
        """The largest violation of the constraints; 0 if all are satisfied."""
        return _violation(self.slack)

    @property
    def curvature(self) -> Array:
        """The initial Hessian: the identity, plus the `information` if there is one."""
        return np.eye(len(self.gradient)) if self.information is None else _with_ridge(self.information, 1.0)

    def merit(self, penalty: float) -> float:
        return self.value + penalty * _price(self.violation)

    def linear_violation(self, d: Array) -> float:
        """Return the violation of the linearised constraints at x + d."""
        return _violation(self.slack + self.jacobian.dot(d))


@dataclass(frozen=True)
class Minimum:
    """The last point `x` of a search; `converged` tells that no step of any length promises to improve it.

    `curvature` (p, p) approximates the Hessian of the Lagrangian there.
    """

    x: Array
    at: Evaluation
    converged: bool
    curvature: Array


def minimise(
    evaluate: Callable[[Array], Evaluation | None],
    start: Array,
    lower: Array,
    upper: Array,
    radius: float = FIRST_RADIUS,
    curvature: Array | None = None,
    precision: float = PRECISION,
    give_up: GiveUp = never,
    most_iterations: int = _MAX_ITERATIONS,
    stray: float = np.inf,
    begun: Evaluation | None = None,
) -> Minimum | None:
    """Return a local minimum found from `start`; None if f is undefined at `start`, or if the search is given up.

    `evaluate` returns None where f is undefined; `begun` is the evaluation at the start, if it is known. The first step
    in each variable is no longer than `radius`: with a small radius the iteration stays in the basin of a good start.
    It starts with the `curvature` (p, p) of a similar problem if one is given. It ends when a step promises to gain
    less than `precision` (relative to 1 + |f|), or after `most_iterations`. For an objective f ≥ 0, no point on the way
    violates a constraint by more than twice the violation at the start plus `stray`.
    """
    x = np.clip(start, lower, upper)
    if (here := begun or evaluate(x)) is None:
        return None
    curvature = here.curvature if curvature is None else curvature
    penalty = max(_FIRST_PENALTY, here.value / (here.violation + stray))
    reductions, gained, may_end = 0, np.inf, False
    active = np.zeros((2, 1 + len(here.slack) + 2 * len(x)), dtype=bool)
    if not len(x):
        return Minimum(x, here, True, curvature)
    for _ in range(most_iterations):
        box = np.maximum(lower - x, -radius), np.minimum(upper - x, radius)
        program, curvature = _program(curvature, here, box, active)
        d, multipliers, steered, broken = _steered_step(program, here, penalty)
        may_end, penalty = may_end and steered == penalty, steered
        merit, size = here.merit(penalty), _size(d)
        predicted = here.value + float((here.gradient + curvature.dot(d) / 2).dot(d))  # f at x + d
        gain = merit - (predicted + penalty * _price(broken))
        is_flat = gain <= precision * (1 + abs(here.value))
        if size < _STEP_TOLERANCE or is_flat:
            if here.violation <= FEASIBLE or penalty >= _LARGEST_PENALTY:
                return Minimum(x, here, is_flat or size < 0.99 * radius, curvature)
            penalty, radius, may_end = 100 * penalty, max(radius, 1e-3), False
            continue
        if may_end and give_up(x, merit, max(gained, gain)):
            return None
        there = evaluate(x + d)
        reached = np.inf if there is None else there.merit(penalty)
        if there is not None and reached > merit - 0.1 * gain:
            # Curved constraints can spoil a good step: correct it to second order, with the constraints at x + d.
            corrected, _ = program.solve(there.slack - here.jacobian.dot(d), penalty)
            if _size(corrected - d) > _STEP_TOLERANCE:
                again = evaluate(x + corrected)
                if again is not None and again.merit(penalty) < reached:
                    d, there, size, reached = corrected, again, _size(corrected), again.merit(penalty)
                    broken = here.linear_violation(d)
        if there is None or reached >= merit:
            radius, may_end = size / 4, False
            if radius < _SMALLEST_RADIUS:
                return Minimum(x, here, False, curvature)
            continue
        gained, may_end = merit - reached, size < radius
        agreement, curvature = gained / gain, _update(curvature, d, here, there, multipliers, broken)
        radius = min(2 * radius, _LARGEST_RADIUS) if agreement > 0.5 else radius / 2 if agreement < 0.1 else radius
        x, here = x + d, there
        enough = max(_FIRST_PENALTY, here.value / (here.violation + stray), _ENOUGH * float(multipliers.sum()))
        if here.violation == 0 and penalty > _ENOUGH * enough and reductions < _MOST_REDUCTIONS:
            penalty, reductions = enough, reductions + 1
    return Minimum(x, here, False, curvature)


def _program(
    curvature: Array, here: Evaluation, box: tuple[Array, Array], active: Flags
) -> tuple[QuadraticProgram, Array]:
    """Return the program of the next step, and its Hessian: the `curvature`, or the point's own if it is indefinite."""
    for hessian in (curvature, here.curvature):
        if program := QuadraticProgram.of(hessian, here.gradient, here.jacobian, *box, active):
            return program, hessian
    raise AssertionError("the curvature of a point is positive definite")


def _steered_step(program: QuadraticProgram, here: Evaluation, penalty: float) -> tuple[Array, Array, float, float]:
    """Return the step, its multipliers, the penalty, and the violation of the linearised constraints after the step.

    The penalty is raised until the step removes half of the violation that any step can remove. With a low penalty the
    iteration would first run to points where f is small, and then come back to another part of the feasible set, or not
    at all (Byrd, Nocedal, Waltz: steering).
    """
    d, multipliers = program.solve(here.slack, penalty)
    left, least = here.linear_violation(d), program.least_violation(here.slack, multipliers)
    if left <= here.violation - _STEERED * (here.violation - least) + FEASIBLE:
        return d, multipliers, penalty, left
    farthest, _ = program.solve(here.slack, _LARGEST_PENALTY)
    enough = here.violation - _STEERED * (here.violation - here.linear_violation(farthest))
    while left > enough + FEASIBLE and penalty < _LARGEST_PENALTY:
        penalty *= 10
        d, multipliers = program.solve(here.slack, penalty)
        left = here.linear_violation(d)
    return d, multipliers, penalty, left


def _size(d: Array) -> float:
    """Return the largest absolute value of the entries of d."""
    return float(np.abs(d).max())


def _violation(slack: Array) -> float:
    """Return the largest violation of g ≥ 0 for g = `slack`, less 1e-10; 0 if it is smaller.

    Rounding errors would otherwise count, and a high penalty would amplify them.
    """
    return max(0.0, -float(slack.min()) - _ROUNDING) if slack.size else 0.0


def _price(violation: float) -> float:
    return violation + violation**2 / 2


def _update(
    curvature: Array, d: Array, here: Evaluation, there: Evaluation, multipliers: Array, broken: float
) -> Array:
    """Return Powell's damped BFGS update of the Lagrangian's Hessian, which stays positive definite.

    If the information matrix predicts the change of slope along the step better, that matrix is updated instead. This
    is not done after a step that left linearised constraints violated by `broken`: multipliers are then as large as the
    penalty, and the curvature of the constraints matters.
    """
    change = there.gradient - here.gradient - multipliers.dot(there.jacobian - here.jacobian)
    along, image = float(d.dot(change)), curvature.dot(d)
    modelled = float(d.dot(image))
    if there.information is not None and broken <= FEASIBLE:
        fresh = there.curvature
        of_fresh = fresh.dot(d)
        if abs((foretold := float(d.dot(of_fresh))) - along) <= abs(modelled - along):
            curvature, image, modelled = fresh, of_fresh, foretold
    if along < 0.2 * modelled:
        weight = 0.8 * modelled / (modelled - along)
        change = weight * change + (1 - weight) * image
        along = 0.2 * modelled
    updated = curvature - image[:, None] * (image / modelled) + change[:, None] * (change / along)
    return _with_ridge(updated)


def _with_ridge(curvature: Array, least: float = 0.0) -> Array:
    """Return the matrix with its diagonal raised by `least`, and by a ridge that limits the condition number."""
    raised = curvature.copy()
    raised.ravel()[:: len(raised) + 1] += least + _RIDGE * curvature.trace()
    return raised
