"""Sequential quadratic programming for a few variables and any number of smooth inequality constraints.

minimise f(x) subject to g(x) ≥ 0 inside a box, by Fletcher's exact-penalty trust-region method: each step solves

    min ½ dᵀ B d + ∇fᵀ d + ρ (s + s²/2)   subject to   g + J d + s ≥ 0,   s ≥ 0,   x + d in the box,   |d| ≤ Δ,

which is always feasible. One slack s for all constraints gives the merit f + ρ (v + v²/2) with v = max(0, −min g): an
exact penalty, because its slope in v is at least ρ. So a start may violate any constraint, and where no point keeps
them, the method still ends at a local minimum of the violation. Where the way asked for a penalty far beyond the
multipliers, it is lowered at a point that keeps all constraints, a few times at most: steps along curved constraints
would be tiny. The merit is f there, whatever the penalty.

A search for the best of several minima may end early: `give_up` is asked after each step that the trust region did not
shorten.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from trackable.arrays import Array

_MAX_ITERATIONS = 1000
_STEP_TOLERANCE = 1e-10
PRECISION = 1e-15
_FEASIBLE = 1e-12
_ROUNDING = 1e-10  # of constraints: a tenth of the back-off of their bounds
FIRST_RADIUS, _LARGEST_RADIUS, _SMALLEST_RADIUS = 0.5, 4.0, 1e-13
_FIRST_PENALTY, _LARGEST_PENALTY = 1e2, 1e9
_STEERED = 0.5
_ENOUGH, _MOST_REDUCTIONS = 10.0, 5  # of the multipliers: a penalty beyond makes steps along curved bounds tiny


GiveUp = Callable[[Array, float, float], bool]
"""Whether a search may end at x with this merit, which none of its last two steps made smaller by more than a gain."""


def never(x: Array, merit: float, gain: float) -> bool:
    """Search on to the minimum."""
    return False


@dataclass(frozen=True)
class Evaluation:
    """f, ∇f (p,), g (m,) and its Jacobian (m, p) at one point."""

    value: float
    gradient: Array
    slack: Array
    jacobian: Array

    @cached_property
    def violation(self) -> float:
        """The largest violation of the constraints; 0 where all are kept."""
        return _violation(self.slack)

    def merit(self, penalty: float) -> float:
        return self.value + penalty * _price(self.violation)

    def linear_violation(self, d: Array) -> float:
        """Return the violation of the linearised constraints at x + d."""
        return _violation(self.slack + self.jacobian @ d)

    def predicted(self, d: Array, curvature: Array, penalty: float) -> float:
        """Return the merit at x + d of the quadratic model."""
        price = penalty * _price(self.linear_violation(d))
        return float(self.value + self.gradient @ d + d @ curvature @ d / 2 + price)


@dataclass(frozen=True)
class Minimum:
    """The last point of the iteration; `converged` if no step improves it. `curvature` is that of the Lagrangian."""

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
) -> Minimum | None:
    """Return a local minimum from `start`; None if f has no value at `start`, or where the search is given up.

    `evaluate` returns None where f has no value. The first step is no longer than `radius`: with a small radius the
    iteration stays in the basin of a good start. It starts with the `curvature` of a similar problem if there is one,
    and ends where a step promises to gain less than `precision` (relative to 1 + |f|).
    """
    x = np.clip(start, lower, upper)
    if (here := evaluate(x)) is None:
        return None
    curvature, penalty, reductions = np.eye(len(x)) if curvature is None else curvature, _FIRST_PENALTY, 0
    gained = np.inf
    if not len(x):
        return Minimum(x, here, True, curvature)
    for _ in range(_MAX_ITERATIONS):
        box = np.maximum(lower - x, -radius), np.minimum(upper - x, radius)
        d, multipliers, penalty = _steered_step(curvature, here, box, penalty)
        gain = here.merit(penalty) - here.predicted(d, curvature, penalty)
        if np.abs(d).max() < _STEP_TOLERANCE or gain <= precision * (1 + abs(here.value)):
            if here.violation <= _FEASIBLE or penalty >= _LARGEST_PENALTY:
                return Minimum(x, here, True, curvature)
            penalty, radius = 100 * penalty, max(radius, 1e-3)
            continue
        there = evaluate(x + d)
        if there is not None and there.merit(penalty) > here.merit(penalty) - 0.1 * gain:
            # Curved constraints can spoil a good step: correct it to second order, with the constraints at x + d.
            corrected, _ = _quadratic_step(curvature, here, there.slack - here.jacobian @ d, box, penalty)
            if (again := evaluate(x + corrected)) is not None and again.merit(penalty) < there.merit(penalty):
                d, there = corrected, again
        if there is None or there.merit(penalty) >= here.merit(penalty):
            radius = np.abs(d).max().item() / 4
            if radius < _SMALLEST_RADIUS:
                return Minimum(x, here, False, curvature)
            continue
        last, gained = gained, here.merit(penalty) - there.merit(penalty)
        agreement, is_whole = gained / gain, np.abs(d).max() < radius
        curvature = _updated(curvature, d, here, there, multipliers)
        radius = min(2 * radius, _LARGEST_RADIUS) if agreement > 0.5 else radius / 2 if agreement < 0.1 else radius
        x, here = x + d, there
        if is_whole and give_up(x, here.merit(penalty), max(last, gained)):
            return None
        enough = max(_FIRST_PENALTY, _ENOUGH * float(np.sum(multipliers)))
        if here.violation == 0 and penalty > _ENOUGH * enough and reductions < _MOST_REDUCTIONS:
            penalty, reductions = enough, reductions + 1
    return Minimum(x, here, False, curvature)


def _steered_step(
    curvature: Array, here: Evaluation, box: tuple[Array, Array], penalty: float
) -> tuple[Array, Array, float]:
    """Return the step, its multipliers, and the penalty, raised until the step removes enough of the violation.

    "Enough" is half of the violation that any step can remove. With a low penalty the iteration would first run to
    where f is small, and come back to another part of the feasible set, or to none (Byrd, Nocedal and Waltz: steering).
    """
    d, multipliers = _quadratic_step(curvature, here, here.slack, box, penalty)
    if here.linear_violation(d) <= _FEASIBLE:
        return d, multipliers, penalty
    least, _ = _quadratic_step(curvature, here, here.slack, box, _LARGEST_PENALTY)
    enough = here.violation - _STEERED * (here.violation - here.linear_violation(least))
    while here.linear_violation(d) > enough + _FEASIBLE and penalty < _LARGEST_PENALTY:
        penalty *= 10
        d, multipliers = _quadratic_step(curvature, here, here.slack, box, penalty)
    return d, multipliers, penalty


def _violation(slack: Array) -> float:
    """Return the largest violation. Rounding errors do not count, because a high penalty would amplify them."""
    return max(0.0, -float(slack.min()) - _ROUNDING) if slack.size else 0.0


def _price(violation: float) -> float:
    return violation + violation**2 / 2


def _quadratic_step(
    curvature: Array, at: Evaluation, slack: Array, box: tuple[Array, Array], penalty: float
) -> tuple[Array, Array]:
    """Return the step d and the multipliers of its constraints: Newton's step where it keeps all of them.

    Otherwise they are found by the dual, a non-negative least squares problem.
    With z = (d, s), H = diag(B, ρ) = L Lᵀ and y = Lᵀ z + L⁻¹ c the quadratic program minimises ‖y‖ over a polyhedron
    A y ≥ b. Its solution follows from the residual of min ‖(Aᵀ; bᵀ) u − (0; 1)‖ over u ≥ 0 (Lawson and Hanson).
    Constraints that no step in the box can violate are left out.
    """
    p = len(at.gradient)
    root, info = scipy.linalg.lapack.dpotrf(curvature, lower=True)
    assert info == 0, "updates keep the curvature positive definite"
    newton = -scipy.linalg.lapack.dpotrs(root, at.gradient, lower=True)[0].reshape(p)
    if np.all((box[0] <= newton) & (newton <= box[1])) and np.all(slack + at.jacobian @ newton >= 0):
        return newton, np.zeros(len(slack))
    near = np.flatnonzero(slack < np.abs(at.jacobian) @ np.maximum(-box[0], box[1]))
    m = len(near)
    factor = np.zeros((p + 1, p + 1))
    factor[:p, :p] = root
    factor[p, p] = np.sqrt(penalty)
    identity = np.eye(p)
    rows = np.zeros((m + 1 + 2 * p, p + 1))
    rows[:m, :p], rows[: m + 1, p] = at.jacobian[near], 1.0
    rows[m + 1 : m + 1 + p, :p], rows[m + 1 + p :, :p] = identity, -identity
    least = np.concatenate([-slack[near], [0.0], box[0], -box[1]])
    shift = _solved(factor, np.append(at.gradient, penalty))
    normals = _solved(factor, rows.T)
    offsets = least + shift @ normals
    scale = max(1.0, float(np.max(np.abs(offsets))))  # y in units of its own size
    u, _ = scipy.optimize.nnls(np.vstack([normals, offsets / scale]), np.append(np.zeros(p + 1), 1.0))
    denominator = 1.0 - offsets / scale @ u
    y = scale * (normals @ u) / denominator
    z = _solved(factor, y - shift, transposed=True)
    multipliers = np.zeros(len(slack))
    multipliers[near] = scale * u[:m] / denominator
    return np.clip(z[:p], *box), multipliers


def _solved(factor: Array, right: Array, transposed: bool = False) -> Array:
    """Return L⁻¹ r or L⁻ᵀ r for a lower triangular L."""
    solution, _ = scipy.linalg.lapack.dtrtrs(factor, right, lower=True, trans=int(transposed))
    return np.asarray(solution)


def _updated(curvature: Array, d: Array, here: Evaluation, there: Evaluation, multipliers: Array) -> Array:
    """Return Powell's damped BFGS update of the Lagrangian's Hessian, which stays positive definite."""
    change = there.gradient - here.gradient - (there.jacobian - here.jacobian).T @ multipliers
    image = curvature @ d
    along, modelled = float(d @ change), float(d @ image)
    if along < 0.2 * modelled:
        weight = 0.8 * modelled / (modelled - along)
        change = weight * change + (1 - weight) * image
        along = 0.2 * modelled
    updated = curvature - np.outer(image, image) / modelled + np.outer(change, change) / along
    # Limit the condition number: beyond it, rounding errors would dominate the step.
    return np.asarray(updated + 1e-10 * np.trace(updated) * np.eye(len(d)))
