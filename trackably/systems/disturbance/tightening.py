"""Bounds drawn in by what an error may take of them: a reference inside them leaves room for the error."""

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import numpy as np
import scipy

from trackably.arguments import real
from trackably.arrays import Array, ArrayLike
from trackably.systems.constrained import ConstrainedSystem, LinearConstraint
from trackably.systems.disturbance.feedback import best_feedback, bound_widths, given_feedback
from trackably.systems.disturbance.invariant import InvariantSet, invariant_set
from trackably.systems.disturbance.measured import Measured, measured
from trackably.systems.disturbance.rationals import float_below
from trackably.systems.disturbance.sets import DisturbanceSet, checked
from trackably.systems.disturbance.zonotope import Zonotope
from trackably.systems.sets.polytope import Polytope
from trackably.systems.sets.scales import unit_scales

_LARGEST_FRACTION = 1e6


@dataclass(frozen=True, eq=False)
class Tightening:
    """A `given` plant, and the `plant` with the same system whose bounds are drawn in.

    Each bound is drawn in by `margin` times the width between both, and, where there is an `invariant` set Z, by what
    an error in Z may take: by h_Z(row) for states, and by h_Z(Kᵀ row) for inputs. If a reference keeps the bounds of
    `plant`, then for every disturbance sequence in W and every start in x_r(0) ⊕ Z, the states and the inputs
    u = u_r + K (x − x_r) of the disturbed system keep the given ones. Where the state is `measured` with noise, y takes
    the place of x: Z is that of its disturbances, and bounds of states are drawn in by h_V(−row) in addition. Raises
    ValueError where nothing is left.
    """

    given: ConstrainedSystem
    margin: float
    invariant: InvariantSet | None
    measured: Measured | None = None

    def __post_init__(self) -> None:
        _ = self.plant  # computed now, to raise its error

    @cached_property
    def plant(self) -> ConstrainedSystem:
        """The plant with its bounds drawn in."""
        if (fraction := self.largest_fraction) <= 1:
            raise ValueError(self._shortage(fraction))
        states = len(self.given.state_set.rows)
        return replace(
            self.given,
            state_set=self._drawn_in(self.given.state_set, self.taken[:states]),
            input_set=self._drawn_in(self.given.input_set, self.taken[states:]),
        )

    def __repr__(self) -> str:
        noise = f", noise={self.noise!r}" if self.noise else ""
        sets = f"state_set={self.plant.state_set}, input_set={self.plant.input_set}"
        return f"Tightening(margin={self.margin:g}, disturbance={self.disturbance!r}{noise}; {sets})"

    @property
    def disturbance(self) -> DisturbanceSet | None:
        """W, without measurement noise; None where nothing is disturbed."""
        if self.measured:
            return self.measured.disturbance
        return self.invariant.disturbance if self.invariant else None

    @property
    def noise(self) -> Zonotope | None:
        """V, if the state is measured with noise."""
        return self.measured.noise if self.measured else None

    @cached_property
    def taken(self) -> list[tuple[Fraction, Fraction]]:
        """What the error may take at the lower and the upper bound of each row, those of states first, exactly."""
        return [self._of_row(constraint) for constraint in self.given.given_constraints]

    @cached_property
    def largest_fraction(self) -> float:
        """The largest f for which f W would leave points in both sets, for the same feedback; a million at most."""
        states = len(self.given.state_set.rows)
        parts = np.array([[float(low), float(high)] for low, high in self.taken]).reshape(-1, 2)
        sides = ((self.given.state_set, parts[:states]), (self.given.input_set, parts[states:]))
        return min(_largest_fraction(bounded, by, self.margin) for bounded, by in sides)

    def _of_row(self, constraint: LinearConstraint) -> tuple[Fraction, Fraction]:
        if self.invariant is None:
            return Fraction(0), Fraction(0)
        up, down = constraint.row, [-r for r in constraint.row]
        if constraint.side == "input":
            return self.invariant.support_of_input(down), self.invariant.support_of_input(up)
        low, high = self.invariant.support(down), self.invariant.support(up)
        return (low + self.measured.support(up), high + self.measured.support(down)) if self.measured else (low, high)

    def _drawn_in(self, bounded: Polytope, by: list[tuple[Fraction, Fraction]]) -> Polytope:
        lower, upper = [], []
        for (low, high), a, b in zip(by, bounded.lower.tolist(), bounded.upper.tolist(), strict=True):
            kept = Fraction(self.margin) * (Fraction(b) - Fraction(a))
            lower.append(-float_below(-(Fraction(a) + low + kept)))
            upper.append(float_below(Fraction(b) - high - kept))
        return Polytope(bounded.rows, lower, upper, bounded.dimension)

    def _shortage(self, fraction: float) -> str:
        """Say which bounds are short by how much, and what would do."""
        named = zip(self.given.given_constraints, self.taken, strict=True)
        short = [(self._missing(constraint, *by), constraint, float(sum(by))) for constraint, by in named]
        missing, worst, taken = max(short, key=lambda found: found[0] / found[1].bounds.width)
        would = (
            f"with this feedback {fraction:.3g} of this disturbance set would do"
            if fraction > 0
            else "no disturbance set would do"
        )
        kept = f" beside the margin of {self.margin:g} of the width on either side" if self.margin else ""
        if missing < 0:
            return f"disturbance: no point keeps all of the bounds together once the errors' part is taken; {would}"
        return (
            f"disturbance: the errors take {taken:.4g} of the {worst.bounds.width:.4g} between the bounds "
            f"{worst.bounds} of {worst.name}{kept}, which are too close by {missing:.4g} at least; {would}"
        )

    def _missing(self, constraint: LinearConstraint, low: Fraction, high: Fraction) -> float:
        return float(low + high) - (1 - 2 * self.margin) * constraint.bounds.width


def tightening(
    plant: ConstrainedSystem,
    disturbance: DisturbanceSet | None = None,
    feedback: ArrayLike | None = None,
    margin: float = 0.0,
    noise: DisturbanceSet | None = None,
) -> Tightening:
    """Return the bounds of a plant drawn in for a disturbance set W, and by a part `margin` of each width.

    The feedback K is given, or a regulator that leaves much room. It is given the measured state, with `noise` in a
    set V: both sets are zonotopes then, and W may be left out. Raises ValueError where the system is not linear, W, V
    or K do not fit it, A + B K does not decay, the margin is none, or nothing is left of a set; TypeError where an
    argument is of another type.
    """
    margin = real("margin", margin)
    if not 0 <= margin < 0.5:
        raise ValueError(f"margin must be a part of a width, at least 0 and less than 0.5, got {margin:g}")
    if disturbance is None and noise is None:
        if feedback is not None:
            raise ValueError("feedback: is only of use with a disturbance set")
        return Tightening(plant, margin, None)
    system = plant.linear
    with_noise = None if noise is None else measured(disturbance, noise, len(system.A))
    W = with_noise.of_measured_state(system.A) if with_noise else checked(disturbance, len(system.A))
    sets = plant.state_set, plant.input_set
    K = best_feedback(system, *sets, W) if feedback is None else given_feedback(feedback, system)
    rows = np.vstack([sets[0].rows, sets[1].rows @ K])
    Z = invariant_set(system, K, W, rows, bound_widths(*sets), unit_scales(sets[0]))
    return Tightening(plant, margin, Z, with_noise)


def _largest_fraction(bounded: Polytope, by: Array, margin: float) -> float:
    """Return the largest f ≤ 1e6 for which a point keeps all rows, their bounds drawn in by f `by` (r, 2) and a margin.

    A linear program in half widths about the middles; ≤ 0 where the margin alone leaves nothing.
    """
    if not len(bounded.rows):
        return _LARGEST_FRACTION
    half = bounded.widths / 2
    alone = (2 - 4 * margin) * half / np.maximum(by.sum(axis=1), half / _LARGEST_FRACTION)
    most = float(min(np.min(alone), _LARGEST_FRACTION))  # of each row alone: enough for boxes
    if len(bounded.rows) <= bounded.dimension and np.linalg.matrix_rank(bounded.rows) == len(bounded.rows):
        return most
    scales = unit_scales(bounded)
    matrix, middle = bounded.rows * scales / half[:, None], (bounded.upper + bounded.lower) / 2 / half
    room = 1 - 2 * margin
    program = scipy.optimize.linprog(
        np.append(np.zeros(bounded.dimension), -1.0),
        A_ub=np.vstack(
            [np.column_stack([matrix, by[:, 1] / half * most]), np.column_stack([-matrix, by[:, 0] / half * most])]
        ),
        b_ub=np.concatenate([middle + room, room - middle]),
        bounds=[(None, None)] * bounded.dimension + [(None, 1.0)],
        method="highs",
    )
    return most * float(program.x[-1]) if program.x is not None else -np.inf
