"""Places of bounds in the program of the function (a time and a side), and the linear rows that represent them.

New places are times at which a function comes near to its bounds: local minima of all margins, searched together.
"""

from bisect import bisect
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property as cached
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array, Flags
from trackably.gp.rows import Rows, Terms
from trackably.gp.signal import KernelSum
from trackably.learning.constraint import Constraint, between, closest, joined, margins_at, overlooked, rows_of
from trackably.learning.problem import ActiveBound, ConstrainedProblem, Side
from trackably.systems.trajectories import Quantities, Signals, Trajectory

LOWER, UPPER = 1.0, -1.0  # the sides of bounds, which are also the signs of their rows

Places = tuple[Array, ...]
"""For each constraint an array (n, 2) of times [s] and sides: `LOWER` or `UPPER`."""


@dataclass(frozen=True)
class Demands:
    """`rows`, weighted sums of signals, that have to be at least `limits`, or equal to them if `is_equation` holds.

    Arrays have shape (r,) for r rows. The row of an upper bound has the opposite sign. `widths` are the widths of the
    bounds, relative to which violations are compared. `places` (r, 2) has times [s] and sides. The row belongs to a
    constraint or to a required value: `owner` is its index among the `names` of all of these, constraints first.
    """

    rows: Rows
    limits: Array
    is_equation: Flags
    widths: Array
    places: Array
    owner: npt.NDArray[np.intp]
    names: tuple[str, ...]

    def among(self, chosen: npt.NDArray[np.intp]) -> "Demands":
        """Return only the rows with the increasing indices `chosen`, with their limits."""
        return Demands(
            self.rows.among(chosen),
            self.limits[chosen],
            self.is_equation[chosen],
            self.widths[chosen],
            self.places[chosen],
            self.owner[chosen],
            self.names,
        )

    def flags(self, among: Places) -> Flags:
        """Return whether the place of each row is `among` those of its constraint, shape (r,)."""
        found, number = np.zeros(len(self.limits), dtype=bool), np.array([1, 1j])  # time and side as one number
        for i, known in enumerate(among):
            own = self.owner == i
            found[own] = np.isin(self.places[own] @ number, known @ number)
        return found

    def select(self, chosen: Flags, constraints: int) -> Places:
        """Return the places of the rows that are `chosen`, flags (r,), for each of this number of constraints."""
        return tuple(self.places[chosen & (self.owner == i)] for i in range(constraints))

    def label(self, a: int) -> tuple[str, Side, float]:
        """Return the name, the side and the time [s] of the bound that row `a` represents."""
        time, side = self.places[a].tolist()
        return (
            self.names[self.owner[a]],
            "equal" if self.is_equation[a] else "lower" if side == LOWER else "upper",
            time,
        )


def places_of(active: Sequence[ActiveBound], names: Sequence[str]) -> Places:
    """Return the times and sides of active bounds, an array (n, 2) for each quantity in `names`.

    Required values are left out.
    """
    sides = {"lower": LOWER, "upper": UPPER}
    return tuple(
        np.array([(b.time, sides[b.side]) for b in active if b.name == name and b.side in sides]).reshape(-1, 2)
        for name in names
    )


def merge(places: Places, new: Places, same: float) -> Places:
    """Return the union of `places` and `new` places (times and sides) for each constraint, sorted by time.

    A new place is left out if another place of the same side is within `same` [s].
    """
    return tuple(_unite(*pair, same) for pair in zip(places, new, strict=True))


def _unite(places: Array, new: Array, same: float) -> Array:
    """Return `places` (times and sides) and those of `new` that have no other one of their side within `same` [s]."""
    added: dict[float, list[float]] = {LOWER: [], UPPER: []}
    for time, side in new[~near_to(places, new, same)].tolist():
        times = added[side]
        at = bisect(times, time)
        if all(abs(time - t) > same for t in times[max(at - 1, 0) : at + 1]):
            times.insert(at, time)
    union = np.concatenate([places, *([[time, side]] for side, times in added.items() for time in times)])
    return union[np.lexsort(union.T[::-1])]


def near_to(known: Array, places: Array, same: float) -> Flags:
    """Return flags (n,): for each of `places` (n, 2), whether a `known` one of the same side is within `same` [s]."""
    found = np.zeros(len(places), dtype=bool)
    for side in (LOWER, UPPER):
        times, own = np.append(np.sort(known[known[:, 1] == side, 0]), np.inf), places[:, 1] == side
        found[own] = times[np.searchsorted(times, places[own, 0] - same)] <= places[own, 0] + same
    return found


class PlacedBounds(NamedTuple):
    """Bounds of the quantity `name` at `times` [s]: `sides` · q ≥ `limits`, or q = `limits` if `is_equation` holds.

    Times, sides and limits have shape (n,). Violations are compared with the `width`.
    """

    name: str
    trajectory: Trajectory
    times: Array
    sides: Array
    limits: Array
    width: float
    is_equation: bool = False


def placed_bounds(problem: ConstrainedProblem, places: Places) -> list[PlacedBounds]:
    """Return the bounds of each constraint at its places, tightened by its back-off, and then the required values.

    `places` has, for each constraint, its times and sides.
    """
    found = []
    for constraint, of_constraint in zip(problem.constraints, places, strict=True):
        quantity, (times, sides) = constraint.quantity, of_constraint.T
        lower, upper = quantity.bounds.shrunk(constraint.backoff * quantity.bounds.width).ends(times)
        limits = np.where(sides == LOWER, lower, -upper)
        found.append(PlacedBounds(quantity.name, quantity, times, sides, limits, quantity.bounds.width))
    for each in problem.required:
        once = np.array([each.time]), np.array([LOWER]), np.array([each.value])
        found.append(PlacedBounds(each.name, each.trajectory, *once, each.tolerance, is_equation=True))
    return found


def demands(problem: ConstrainedProblem, places: Places, near: Signals) -> Demands:
    """Return a row (weighted sum of signals) and its limit for each bound at each place, then for each required value.

    A place is a time and a side. Nonlinear formulas are linearised at the signals `near`.
    """
    bounds = placed_bounds(problem, places)
    arguments = rows_of([(q, of.times) for of in bounds for _, q in of.trajectory.arguments], len(problem.prior.parts))
    owner = np.repeat(np.arange(len(bounds)), [len(of.times) for of in bounds])  # the bound of each row
    offsets, factors, into = [np.empty(0)], [np.empty(0)], [owner[:0]]
    for i, of in enumerate(bounds):
        offset, slopes = _linearise(of.trajectory, of.times, near)
        offsets.append(of.sides * offset)
        factors.append((of.sides * slopes).ravel())
        into.append(np.tile(np.flatnonzero(owner == i), len(slopes)))
    factor, row = np.concatenate(factors), np.concatenate(into)
    terms = tuple(Terms(of.times, of.weights * factor[of.of_row], row[of.of_row]) for of in arguments.terms)
    return Demands(
        Rows(np.concatenate(offsets), terms),
        np.concatenate([np.empty(0), *(of.limits for of in bounds)]),
        np.array([of.is_equation for of in bounds], dtype=bool)[owner],
        np.array([of.width for of in bounds])[owner],
        np.concatenate([np.empty((0, 2)), *(np.column_stack([of.times, of.sides]) for of in bounds)]),
        owner,
        tuple(of.name for of in bounds),
    )


def _linearise(trajectory: Trajectory, times: Array, near: Signals) -> tuple[Array, Array]:
    """Return o (n,) and s (k, n) of q ≈ o + Σ_i s_i (q_i − c_i) at each time, for the k arguments q_i of q.

    Each q_i is a weighted sum of signals plus a constant c_i. The linearisation at the signals `near` is q ≈ q(v) +
    Σ_i ∂q/∂q_i (q_i − v_i), where v_i are the arguments for these signals. If q is linear, o is its constant, s = 1.
    """
    if trajectory.functional is not None:
        return np.full(times.shape, float(trajectory.functional.offset)), np.ones((1, len(times)))
    at = trajectory.arguments_at(near, times)
    slopes, offsets = trajectory.slopes(at), np.array(trajectory.value(at))
    for name, functional in trajectory.arguments:
        offsets += slopes[name] * (float(functional.offset) - at[name])
    return offsets, np.array([np.broadcast_to(slopes[name], times.shape) for name in at])


_IN_REACH = 0.5  # part of a width: bounds on nonlinear formulas are kept for steps of θ only if their slack is smaller

Minima = list[tuple[Array, Array]]
"""For each constraint: times [s] of local minima of its margin, and the margins there as parts of the bounds' width."""


@dataclass(frozen=True, eq=False)
class MarginScan:
    """Search for small margins of the function with these `signals` under the `constraints`."""

    constraints: Sequence[Constraint]
    signals: tuple[KernelSum, ...]

    def closest(self, places: Places) -> Minima:
        """Return the local minima of each margin, and negative margins between neighbouring times of `places`.

        A function that is constrained at two times may violate its bounds between these times, where the grid of the
        index set may have no point.
        """
        inside = between(self.constraints, self._all, [at[:, 0] for at in places])
        return joined(closest(self.constraints, self), inside)

    def with_overlooked(self, found: Minima) -> Minima:
        """Return the minima `found` before, and further violations between kinks that the grid of `closest` missed."""
        return joined(found, overlooked(self.constraints, self))

    def at(self, times: Sequence[Array]) -> Minima:
        """Return the `times` [s] of each constraint, with its margins there as parts of the bounds' width."""
        pairs = zip(self.constraints, times, margins_at(self._all, times), strict=True)
        return [(at, margins / constraint.quantity.bounds.width) for constraint, at, margins in pairs]

    def places(self, found: Minima, below: Sequence[float]) -> Places:
        """Return the times among `found` at which margins are below the limit `below` of their constraint.

        Each comes with the side of the nearer bound.
        """
        chosen = []
        for constraint, (at, margins), least in zip(self.constraints, found, below, strict=True):
            times = at[np.isfinite(margins) & (margins < least)]
            low, high = self._slacks(constraint, times)
            chosen.append(np.column_stack([times, np.where(low < high, LOWER, UPPER)]))
        return tuple(chosen)

    def near(self, places: Places) -> Places:
        """Return those of the `places` (times and sides) at which the slack is below half the width of the bounds."""
        kept = []
        for constraint, at in zip(self.constraints, places, strict=True):
            slack = np.where(at[:, 1] == LOWER, *self._slacks(constraint, at[:, 0]))
            kept.append(at[slack < _IN_REACH * constraint.quantity.bounds.width])
        return tuple(kept)

    def _slacks(self, constraint: Constraint, times: Array) -> tuple[Array, Array]:
        """Return the distances of a constraint's quantity from its lower and from its upper bound at `times` [s]."""
        values, (lower, upper) = constraint.quantity(self.signals, times), constraint.quantity.bounds.ends(times)
        return values - lower, upper - values

    @cached
    def _all(self) -> Quantities:
        return Quantities(tuple(constraint.quantity for constraint in self.constraints), self.signals)
