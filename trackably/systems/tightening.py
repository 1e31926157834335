"""Tightened bounds: if a reference satisfies them, the disturbed system near it satisfies the given bounds."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import islice, product

import numpy as np
import scipy

from trackably.arguments import array, instance, real
from trackably.arrays import Array, ArrayLike
from trackably.checker.disturbances import Errors, support_of
from trackably.checker.subject import Side
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import (
    DisturbanceSet,
    ModelError,
    Zonotope,
    disturbances_of_errors,
    require_disturbance,
    require_zonotope,
)
from trackably.systems.intervals import Interval, move_end
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope, deepest, unit_scales
from trackably.systems.rationals import exact, float_above, float_below

# How fast the error decays under a feedback, and how far disturbances take it, in float64.

LONGEST = 4000
"""Largest number of steps of a decay: an error that needs more steps counts as one that does not decay."""

_DECAYED = 1e-7  # row · A_Kⁱ has decayed when its size is at most this part of its largest size
_AT_ONCE = 50  # powers that are evaluated in one array; LONGEST is a multiple


class NoInvariantSetError(ValueError):
    """The error does not decay under this feedback, or so slowly that no invariant set is computed."""


def closed_loop(system: LinearSystem, feedback: Array) -> Array:
    """Return A_K = A + B K in float64, shape (n, n)."""
    return system.A + system.B @ feedback


def errors_reach(plant: ConstrainedSystem, K: Array, disturbance: DisturbanceSet, rows: Array) -> tuple[Array, Array]:
    """Return Σ_{i≥0} h_W((A_Kⁱ)ᵀ row) for rows (r, n) and for −rows, in float64, each of shape (r,).

    h_W is the support function of the `disturbance` set W, and A_K = A + B K. The sum is the largest row · e of an
    error e that disturbances in W can cause. It ends when row · A_Kⁱ, in units of the states, is below 1e-7 of its
    largest size. Raises NoInvariantSetError if this takes more than 4000 steps, or never happens.
    """
    A_K, scales, both = closed_loop(plant.linear, K), unit_scales(plant.state_set), np.vstack([rows, -rows])
    if not spectral_radius(A_K) < 1:
        raise NoInvariantSetError(
            "feedback: the eigenvalues of A + B K must lie inside the unit circle, but one has the size "
            f"{spectral_radius(A_K):.6g}; give another feedback="
        )
    steps, (total, largest) = powers(both, A_K), np.zeros((2, len(both)))
    while True:
        moved = np.array([*islice(steps, _AT_ONCE)])
        sizes = np.max(np.abs(moved) * scales, axis=2)
        reached = np.maximum.accumulate(np.vstack([largest, sizes]))[1:]
        decayed = np.flatnonzero(np.all(sizes <= _DECAYED * reached, axis=1))
        used = moved[: decayed[0] + 1] if decayed.size else moved
        total = np.cumsum(np.vstack([total, disturbance.support(used)]), axis=0)[-1]  # in the order of the steps
        if decayed.size:
            return total[: len(rows)], total[len(rows) :]
        largest = reached[-1]


def powers(rows: Array, A_K: Array) -> Iterator[Array]:
    """Yield rows, rows A_K, rows A_K², … (r, n); raise NoInvariantSetError after 4000 of them."""
    for _ in range(LONGEST):
        yield rows
        rows = rows @ A_K
    raise NoInvariantSetError(
        f"feedback: the error decays too slowly under A + B K, which has an eigenvalue of size "
        f"{spectral_radius(A_K):.6g}: it has not decayed after {LONGEST} steps; give a feedback= with smaller "
        "eigenvalues"
    )


def spectral_radius(A_K: Array) -> float:
    """Return the largest absolute value of the eigenvalues of A_K."""
    return float(np.max(np.abs(np.linalg.eigvals(A_K))))


# Feedback against disturbances: of the linear-quadratic regulators that leave nearly the most slack, the fastest.

# Weights of the input, and rates of decay, of the regulators that are tried.
INPUT_WEIGHTS = (1e-4, 1e-2, 1.0, 1e2)
RATES = (1.0, 0.95, 0.9, 0.8)
_SPARED = 0.05  # slack, in widths, that may be given up for an error that decays faster
_FREE = 1e-6  # this multiple of the scaled identity is added to weights, which are definite then even without bounds
_BITS = 20  # entries of K are rounded to this number of binary digits, so that rational numbers stay short
_NOTHING = 1e-10  # entries of K below this part of the largest one, in units of the sets, become zero


def best_feedback(plant: ConstrainedSystem, disturbance: DisturbanceSet) -> Array:
    """Return the K (m, n) with the fastest decay of errors, among the regulators that leave nearly the most slack.

    Slack is the part of a bound's width that the errors leave, for the bound with the least slack. The regulators have
    several weights of the input and several rates of decay; errors are weighted relative to the widths of the sets.
    Slack may be 0.05 less than the largest one, because errors may then decay in tens of steps instead of hundreds.
    Raises NoInvariantSetError if no regulator makes the error decay.
    """
    found, widths = list[tuple[float, Array]](), bound_widths(plant)
    for weight, rate in product(INPUT_WEIGHTS, RATES):
        try:
            K = regulator(plant, weight, rate)
            taken = np.add(*errors_reach(plant, K, disturbance, error_rows(plant, K)))
            found.append((float(np.min(1 - taken / widths, initial=1.0)), K))
        except (np.linalg.LinAlgError, NoInvariantSetError):  # another weight or rate may have a regulator
            continue
    if not found:
        raise NoInvariantSetError(
            "feedback: no linear-quadratic regulator was found under which errors decay; give feedback=K of your own"
        )
    most = max(left for left, _ in found)
    good = [K for left, K in found if left >= most - _SPARED]
    return min(good, key=lambda K: spectral_radius(closed_loop(plant.linear, K)))


def regulator(plant: ConstrainedSystem, input_weight: float, rate: float) -> Array:
    """Return K of min Σ_k rate⁻²ᵏ (‖x(k)‖²_Q + `input_weight` ‖u(k)‖²_R) for weights Q and R of the sets.

    Q and R weight errors relative to widths (`set_weight`). All eigenvalues of A + B K have absolute values below
    `rate`, which is at most 1. K has few binary digits, so that it is exact in short rational numbers. Entries that are
    only rounding errors are set to zero, so that decoupled states stay decoupled. Raises NumPy's LinAlgError if K is
    not found.
    """
    Q, R = set_weight(plant.state_set), input_weight * set_weight(plant.input_set)
    A, B = plant.linear.A / rate, plant.linear.B / rate
    P = scipy.linalg.solve_discrete_are(A, B, Q, R)
    K = -np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    if not np.all(np.isfinite(K)):
        raise np.linalg.LinAlgError("regulator: K is not finite; give another input_weight or rate")
    sizes = np.abs(K) * unit_scales(plant.state_set) / unit_scales(plant.input_set)[:, None]
    mantissas, exponents = np.frexp(np.where(sizes > _NOTHING * np.max(sizes), K, 0.0))
    return np.asarray(np.ldexp(np.round(np.ldexp(mantissas, _BITS)), exponents - _BITS))


def error_rows(plant: ConstrainedSystem, K: Array) -> Array:
    """Return the matrix (r, n) that maps an error e of the state to the changes of all bounded quantities.

    These are the rows of the state set, then those of the input set, as inputs change by K e.
    """
    return np.vstack([plant.state_set.rows, plant.input_set.rows @ K])


def bound_widths(plant: ConstrainedSystem) -> Array:
    """Return the widths of all pairs of bounds (r,), states first."""
    return np.concatenate([plant.state_set.widths, plant.input_set.widths])


def set_weight(bounded: Polytope) -> Array:
    """Return the matrix (n, n) of Σ (row · e / width)², made definite by a small multiple of the scaled identity."""
    rows = bounded.rows / bounded.widths[:, None]
    weight = rows.T @ rows + _FREE * np.diag(1 / unit_scales(bounded) ** 2)
    return np.asarray((weight + weight.T) / 2)


# A robustly invariant set of the error: how far a disturbed system under feedback may be from its reference.

_CONTRACTION, _ROUNDING = 0.5, 1e-9  # α is at most the first number, enlarged by the second to cover rounding
# N is large enough if in each bound's direction the last part of Z, the sum over P, extends at most _TAIL_OF_HEAD times
# as far as the first, the sum over W, or at most _TAIL_OF_WIDTH times the distance between the bounds.
_TAIL_OF_HEAD, _TAIL_OF_WIDTH = 1e-2, 1e-5
_LEAST_EXTENT = 1e-3  # least half-width p_i of P, relative to the largest extent of errors, both in state scales


@dataclass(frozen=True, eq=False)
class InvariantSet(Errors):
    """Z = ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P with A_K = A + B K: e ∈ Z and w ∈ W imply A_K e + w ∈ Z.

    N = `head` ≥ 1, s = `terms` ≥ 1, 0 ≤ α = `contraction` < 1, and P = {|x_i| ≤ p_i} with p = `box` (n,). It is
    invariant because W ⊆ P and A_Kˢ P ⊆ α P. For then Z_P = (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P is invariant for P, and so for W
    (Raković et al., 2005: Invariant approximations of the minimal robust positively invariant set). Hence A_K Z ⊕ W =
    ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (W ⊕ A_K Z_P) ⊆ Z. P has an interior even if W is flat. The sum over W is part of every
    invariant set that contains 0, so Z exceeds the smallest of these sets by at most the last part of Z. `support`
    returns h_Z(row) = max {row · e : e ∈ Z} as numerator and denominator.
    """

    disturbance: DisturbanceSet

    @cached_property
    def feedback(self) -> Array:
        """The feedback K in float64, shape (m, n)."""
        return array("feedback: K", self.K, None, None)

    @cached_property
    def closed_loop(self) -> Array:
        """The matrix A_K = A + B K of the closed loop in float64, shape (n, n)."""
        return np.array(self.A) + np.array(self.B) @ self.feedback


def invariant_set(plant: ConstrainedSystem, feedback: Array, disturbance: DisturbanceSet) -> InvariantSet:
    """Return a robustly invariant set of the error, about 1 % larger than the smallest one in each bound's direction.

    For W = {0} it is {0}. Raises NoInvariantSetError if the error does not decay, or decays too slowly.
    """
    scales, A_K = unit_scales(plant.state_set), closed_loop(plant.linear, feedback)
    (A, B, K), n = (tuple(map(tuple, of.tolist())) for of in (plant.linear.A, plant.linear.B, feedback)), len(scales)
    extents = np.maximum(*errors_reach(plant, feedback, disturbance, np.eye(n)))
    size = float(np.max(extents / scales))
    if not size:
        return InvariantSet(A, B, K, disturbance, 1, 1, 0.0, (0.0,) * n)
    box = np.maximum(extents, _LEAST_EXTENT * size * scales) * (1 + _ROUNDING)
    terms, contraction = _contraction(A_K, box)
    head = _head(A_K, disturbance, box, terms, contraction, error_rows(plant, feedback), bound_widths(plant))
    return InvariantSet(A, B, K, disturbance, head, terms, contraction, tuple(box.tolist()))


def _contraction(A_K: Array, box: Array) -> tuple[int, float]:
    """Return s and α with A_Kˢ P ⊆ α P for P = {|x_i| ≤ `box`_i}, where α is at most about one half."""
    contractions = list[float]()
    for power in powers(A_K, A_K):
        contractions.append(float(np.max(np.abs(power) @ box / box)))
        if contractions[-1] <= _CONTRACTION:
            break
    return len(contractions), contractions[-1] * (1 + _ROUNDING) + _ROUNDING


def _head(
    A_K: Array, disturbance: DisturbanceSet, box: Array, terms: int, contraction: float, rows: Array, widths: Array
) -> int:
    """Return the smallest N for which the sum over P extends Z only a little in the direction of each row.

    Z = ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P, with W the `disturbance` set, P = {|x_i| ≤ `box`_i}, s = `terms`
    and α = `contraction`. In each row, the sum over P may extend 1% as far as the sum over W, or 1e-5 of the distance
    between the bounds (`widths`) if that is more.
    """
    supports, sizes, head = list[Array](), list[Array](), np.zeros((2, len(rows)))
    for N, moved in enumerate(powers(rows, A_K), start=1 - terms):
        supports.append(disturbance.support(np.stack([moved, -moved])))
        sizes.append(np.abs(moved) @ box)
        if N < 1:
            continue
        head += supports[N - 1]
        tail = np.sum(sizes[N:], axis=0) / (1 - contraction)
        if np.all(tail <= np.maximum(_TAIL_OF_HEAD * np.min(head, axis=0), _TAIL_OF_WIDTH * widths)):
            break
    return N


Taken = tuple[Fraction, Fraction]
"""By how much the lower and the upper bound of a row are tightened, exactly."""

_LARGEST_FRACTION = 1e6  # larger multiples of a disturbance set are not told apart


@dataclass(frozen=True, eq=False)
class Tightening:
    """A `given` plant, and the `plant` with the same system and tightened bounds.

    Each bound is tightened by `margin` times the distance to the opposite bound. If there are disturbances, each bound
    is also tightened by the largest effect of an error in the `invariant` set Z: h_Z(row) for states, and h_Z(Kᵀ row)
    for inputs, with the `feedback` K and the support function h_Z(η) = max {η · e : e ∈ Z}. If a reference satisfies
    the bounds of `plant`, then for every sequence of disturbances in W, the `disturbance`, and every start in x_r(0) ⊕
    Z, the states and the inputs u = u_r + K (x − x_r) of the disturbed system satisfy the given bounds. If the measured
    state is y = x + v with `noise` v ∈ V, then u = u_r + K (y − x_r), Z contains the errors of y, and bounds of states
    are also tightened by h_V(−row). With a `model_error`, all of this holds for every plant of its convex hull.
    ValueError: nothing is left of a set.
    """

    given: ConstrainedSystem
    margin: float
    disturbance: DisturbanceSet | None = None
    feedback: Array | None = None
    noise: Zonotope | None = None
    model_error: ModelError | None = None

    def __post_init__(self) -> None:
        _ = self.plant  # computed here, to raise its error as soon as the object is created

    @cached_property
    def invariant(self) -> InvariantSet | None:
        """The invariant set Z, which contains the errors; None if there are no disturbances."""
        if self.disturbance is None or self.feedback is None:
            return None
        of_errors = disturbances_of_errors(self.given, self.disturbance, self.noise, self.model_error)
        return invariant_set(self.given, self.feedback, of_errors)

    @cached_property
    def plant(self) -> ConstrainedSystem:
        """The plant with tightened bounds."""
        return self.plant_for(1.0)

    def plant_for(self, size: float) -> ConstrainedSystem:
        """Return the plant with bounds tightened for disturbances and a model error `size` times as large, same K.

        ValueError: nothing is left of a set.
        """
        if (fraction := self.largest_fraction) <= size:
            raise ValueError(self._shortage(fraction))
        state_set, input_set = (
            bounded.with_bounds([self._tighten(*of, size) for of in zip(bounded.bounds, taken, strict=True)])
            for bounded, taken in self.sides
        )
        return replace(self.given, state_set=state_set, input_set=input_set)

    def __repr__(self) -> str:
        noise = f", noise={self.noise!r}" if self.noise else ""
        sets = f"state_set={self.plant.state_set}, input_set={self.plant.input_set}"
        return f"Tightening(margin={self.margin:g}, disturbance={self.disturbance!r}{noise}; {sets})"

    @cached_property
    def largest_fraction(self) -> float:
        """The largest f for which the disturbance set f W, with the same K, leaves both sets non-empty; at most 1e6."""
        return min(_largest_fraction(*of, self.margin) for of in self.sides)

    @cached_property
    def sides(self) -> list[tuple[Polytope, list[Taken]]]:
        """The given state set and input set, each with how much errors tighten both bounds of each row, exactly."""
        given: dict[Side, Polytope] = {"state": self.given.state_set, "input": self.given.input_set}
        return [(of, [self.taken_from(side, row) for row, _ in of.bounded_rows]) for side, of in given.items()]

    def taken_from(self, side: Side, row: Sequence[Fraction]) -> Taken:
        """Return by how much errors tighten the lower and the upper bound of row · x or row · u, exactly."""
        if (Z := self.invariant) is None:
            return Fraction(0), Fraction(0)
        of_error = (exact(row) if side == "state" else exact(row) @ exact(Z.K)).tolist()
        V = self.noise if side == "state" else None
        up, down = (Fraction(*Z.support([sign * r for r in of_error])) for sign in (1, -1))
        return down + support_of(V, row), up + support_of(V, [-r for r in row])

    def _tighten(self, bounds: Interval, taken: Taken, size: float) -> Interval:
        width = Fraction(bounds.width) if bounds.moving else Fraction(bounds.upper) - Fraction(bounds.lower)
        low, high = (by * Fraction(size) + Fraction(self.margin) * width for by in taken)
        return Interval(
            move_end(bounds.low, lambda value: float_above(Fraction(value) + low)),
            move_end(bounds.high, lambda value: float_below(Fraction(value) - high)),
        )

    def _shortage(self, fraction: float) -> str:
        """Return a message: which bounds are too close for errors, by how much, and that `fraction` W is possible."""
        what, whole = ("model_error", " and model error") if self.model_error else ("disturbance", "")
        would = (
            f"with this feedback (feedback= takes another) at most {fraction:.3g} times this disturbance set{whole} is "
            "possible"
            if fraction > 0
            else "no disturbance is possible, however small"
        )
        taken = np.array([float(low + high) for _, of in self.sides for low, high in of])
        widths = bound_widths(self.given)
        worst = int(np.argmax(taken / widths))
        bound, width = self.given.given_constraints[worst], widths[worst]
        if (missing := taken[worst] - (1 - 2 * self.margin) * width) < 0:
            return f"{what}: no point satisfies all bounds at once after they are tightened for the errors; {would}"
        kept = f" in addition to the margin of {self.margin:g} of the width on either side" if self.margin else ""
        return (
            f"{what}: the errors take {taken[worst]:.4g} of the {width:.4g} between the bounds {bound.bounds} of "
            f"{bound.name}{kept}, which are too close by {missing:.4g} at least; {would}"
        )


def tightening(
    plant: ConstrainedSystem,
    disturbance: DisturbanceSet | None = None,
    feedback: ArrayLike | None = None,
    margin: float = 0.0,
    noise: DisturbanceSet | None = None,
    model_error: ModelError | None = None,
) -> Tightening:
    """Return the bounds of a plant, tightened for a disturbance set W and by a part `margin` of each width.

    The feedback K is given, or a regulator that leaves much slack is chosen (`best_feedback`). With a `noise` set V,
    the feedback acts on the noisy measurement of the state. With noise or a `model_error`, all sets are zonotopes, and
    W may be left out. ValueError: the system is not linear, W, V or K do not fit the system, errors do not decay under
    A + B K, the margin is invalid, or nothing is left of a set. TypeError: an argument is of another type.
    """
    margin = real("margin", margin)
    if not 0 <= margin < 0.5:
        raise ValueError(f"margin: expected a part of a bound's width, at least 0 and less than 0.5, got {margin:g}")
    if disturbance is None and noise is None and model_error is None:
        if feedback is not None:
            raise ValueError(
                "feedback: is only of use with a disturbance, measurement_noise or model_error; give one of them, or "
                "no feedback"
            )
        return Tightening(plant, margin)
    if not isinstance(plant.system, LinearSystem):
        sets = {"disturbance": disturbance, "measurement_noise": noise, "model_error": model_error}
        raise ValueError(
            f"{next(name for name, given in sets.items() if given is not None)}: expected a plant with a linear "
            f"system, got one with a nonlinear system of the states {', '.join(plant.system.states)}; give margin= "
            "instead, which leaves a part of each bound's width free"
        )
    n = len(plant.linear.A)
    W = require_disturbance(Zonotope([Fraction(0)] * n) if disturbance is None else disturbance, n)
    V = None if noise is None else require_zonotope("measurement_noise", noise)
    of_errors = disturbances_of_errors(plant, W, V, model_error)
    K = best_feedback(plant, of_errors) if feedback is None else array("feedback: K", feedback, *plant.linear.B.T.shape)
    return Tightening(plant, margin, W, K, V, model_error)


def _largest_fraction(bounded: Polytope, taken: Sequence[Taken], margin: float) -> float:
    """Return the largest f ≤ 1e6 for which a point satisfies all rows, with bounds tightened by f times `taken`.

    Both bounds are also tightened by `margin` times the width. f is the optimum of a linear program in which each row
    is divided by half its width (`Polytope.centred`); f ≤ 0 if the margin alone leaves no point. If a bound moves in
    time, or rows are independent, each row is considered alone, at its least width.
    """
    if not len(bounded.rows):
        return _LARGEST_FRACTION
    by, half = np.array(taken, dtype=float), bounded.widths / 2
    alone = (2 - 4 * margin) * half / np.maximum(by.sum(axis=1), half / _LARGEST_FRACTION)
    most = float(min(np.min(alone), _LARGEST_FRACTION))  # rows one by one; exact if they are independent
    if bounded.moves or np.linalg.matrix_rank(bounded.rows) == len(bounded.rows):
        return most
    (H, h, _, _), (low, high) = bounded.centred, by.T / half * most
    return most * deepest(H, np.append(high, low), h - 2 * margin)[0]


# The plant for learning, with its bounds tightened for disturbances.


def require_plant(plant: object) -> None:
    """Raise TypeError unless `plant` is a ConstrainedSystem (a system with its state set and its input set)."""
    instance("plant", plant, ConstrainedSystem, "a ConstrainedSystem(system, state_set, input_set)")


def require_bounds(plant: ConstrainedSystem) -> None:
    """Raise ValueError if nothing is bounded."""
    if not plant.quantities:
        raise ValueError("plant: nothing is bounded, so there is nothing to prove; give a state or an input bounds")


def tighten_plant(
    plant: ConstrainedSystem,
    disturbance: DisturbanceSet | None,
    feedback: ArrayLike | None,
    margin: float,
    noise: DisturbanceSet | None,
    model_error: ModelError | None = None,
) -> tuple[ConstrainedSystem, Tightening | None]:
    """Return the plant with tightened bounds, and the tightening; the plant itself and None if nothing is tightened.

    TypeError: `plant` is no ConstrainedSystem. ValueError: nothing is bounded. Raises also the errors of `tightening`.
    """
    require_plant(plant)
    require_bounds(plant)
    found = tightening(plant, disturbance, feedback, margin, noise, model_error)
    return (found.plant, found) if found.margin or found.invariant is not None else (plant, None)
