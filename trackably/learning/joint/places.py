"""Places of bounds in the program of the function: a time and a side; and the rows that they are."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array, Flags
from trackably.gp.rows import Rows, Terms
from trackably.gp.signal import KernelSum
from trackably.learning.problem import ActiveBound, ConstrainedProblem, Side
from trackably.systems.flat.functional import Functional
from trackably.systems.flat.trajectory import Trajectory

LOWER, UPPER = 1.0, -1.0
_MANY, _MOST = 500, 1200  # active places: steps in θ are taken with no more

Places = tuple[Array, ...]
"""For each constraint an array (n, 2) of times [s] and sides: `LOWER` or `UPPER`."""


class Label(NamedTuple):
    """Which bound a row is: of the quantity `name`, at `time` [s]."""

    name: str
    side: Side
    time: float


@dataclass(frozen=True)
class Demands:
    """Rows that have to be at least `limits`, or equal to them where `is_equation` holds: shapes (r,).

    The row of an upper bound has the opposite sign. `widths` are those of the bounds, to compare violations. `labels`
    are the name, the side and the time [s] of each row.
    """

    rows: Rows
    limits: Array
    is_equation: Flags
    widths: Array
    labels: tuple[Label, ...]

    def among(self, chosen: npt.NDArray[np.intp]) -> "Demands":
        """Return the chosen demands, by their increasing indices."""
        return Demands(
            self.rows.among(chosen),
            self.limits[chosen],
            self.is_equation[chosen],
            self.widths[chosen],
            tuple(self.labels[a] for a in chosen.tolist()),
        )


def chosen(places: Places, flags: Flags) -> Places:
    """Return the places whose rows have a flag; rows of pins come after those of all places, and are no places."""
    ends = accumulate(map(len, places))
    return tuple(
        of_constraint[flags[end - len(of_constraint) : end]] for of_constraint, end in zip(places, ends, strict=True)
    )


def fewer(places: Places, active: Places) -> Places:
    """Return the places, or of many active ones every second: neighbours hardly differ in how they move with θ."""
    if sum(map(len, active)) <= _MANY:
        return places
    while sum(map(len, active)) > _MOST:
        active = tuple(of_constraint[::2] for of_constraint in active)
    return active


def places_of(active: Sequence[ActiveBound], names: Sequence[str]) -> Places:
    """Return the places of active bounds for the quantities with these names; pins are no places."""
    sides = {"lower": LOWER, "upper": UPPER}
    return tuple(
        np.array([(b.time, sides[b.side]) for b in active if b.name == name and b.side in sides]).reshape(-1, 2)
        for name in names
    )


def flags(places: Places, among: Places) -> Flags:
    """Return which of the places are also in `among`, one flag for each, all constraints together."""
    known = [set(map(tuple, of_constraint.tolist())) for of_constraint in among]
    pairs = zip(places, known, strict=True)
    return np.array([tuple(place) in those for some, those in pairs for place in some.tolist()], dtype=bool)


def demands(problem: ConstrainedProblem, places: Places, near: Sequence[KernelSum]) -> Demands:
    """Return all places as rows; formulas are linearised at the signals `near`."""
    terms: list[list[Terms]] = [[] for _ in problem.prior.parts]
    offsets, limits, widths, labels = [np.empty(0)], [np.empty(0)], [np.empty(0)], list[Label]()
    for constraint, of_constraint in zip(problem.constraints, places, strict=True):
        times, sides = of_constraint.T
        width = constraint.quantity.bounds.width
        bounds = constraint.quantity.bounds.shrunk(constraint.backoff * width)
        offsets.append(_add_terms(terms, len(labels), constraint.quantity.trajectory, times, sides, near))
        limits.append(np.where(sides == LOWER, bounds.lower, -bounds.upper))
        widths.append(np.full(len(times), width))
        name = constraint.quantity.name
        labels += [Label(name, "lower" if side == LOWER else "upper", time) for time, side in of_constraint.tolist()]
    for pin in problem.pins:
        offsets.append(_add_terms(terms, len(labels), pin.trajectory, np.array([pin.time]), np.ones(1), near))
        limits.append(np.array([pin.value]))
        widths.append(np.array([pin.tolerance]))
        labels.append(Label(pin.name, "equal", pin.time))
    is_equation = np.arange(len(labels)) >= len(labels) - len(problem.pins)
    rows = Rows(np.concatenate(offsets), tuple(map(Terms.joined, terms)))
    return Demands(rows, np.concatenate(limits), is_equation, np.concatenate(widths), tuple(labels))


def _add_terms(
    terms: list[list[Terms]], first: int, trajectory: Trajectory, times: Array, sides: Array, near: Sequence[KernelSum]
) -> Array:
    """Add the terms of a trajectory at these times and sides, as rows from `first` on, to those of each process.

    Return the rows' offsets.
    """
    offsets, parts = _linearised(trajectory, times, near)
    rows = np.arange(first, first + len(times))
    for functional, slope in parts:
        for c, weights in functional.rounded:
            instants, of_each = functional.instants(times, len(weights)), weights[:, None] * (sides * slope)
            terms[c].append(Terms(instants.ravel(), of_each.ravel(), np.tile(rows, len(weights))))
    return sides * offsets


def _linearised(
    trajectory: Trajectory, times: Array, near: Sequence[KernelSum]
) -> tuple[Array, list[tuple[Functional, Array]]]:
    """Return o and s_i of q ≈ o + Σ_i s_i (q_i − offset of q_i) at each time, for signals like those of `near`.

    It is q ≈ q(v) + Σ_i ∂q/∂q_i (q_i − v_i), with v_i the arguments at these signals. A functional is linear whatever
    the signals are.
    """
    if trajectory.functional is not None:
        return np.full(times.shape, float(trajectory.functional.offset)), [(trajectory.functional, np.ones(()))]
    at = {name: functional(near, times) for name, functional in trajectory.arguments}
    slopes = trajectory.slopes(at)
    offsets, parts = np.array(trajectory.value(at)), []
    for name, functional in trajectory.arguments:
        offsets += slopes[name] * (float(functional.offset) - at[name])
        parts.append((functional, slopes[name]))
    return offsets, parts
