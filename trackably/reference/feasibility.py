"""Find bounds and waypoints that no reference can satisfy, whatever its kernel and its samples."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from trackably.arrays import Array, Flags
from trackably.certificates.form import as_written
from trackably.certificates.judge import judge_contradiction
from trackably.certificates.outcome import Impossible, InfeasibleTightening
from trackably.checker import subject
from trackably.checker.certificate import Claim
from trackably.checker.contradiction import FORMAT, VERSION, Contradiction, Gap, Value, wanted_boxes
from trackably.checker.form import a_plant
from trackably.checker.moving import ends_at
from trackably.reference.waypoints import WINDOW, Waypoint, coordinates, extent
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import unit_scales
from trackably.systems.tightening import Tightening

_scipy: Any = scipy  # SciPy's annotations refuse some arguments that it takes

# Every reference has to satisfy the dynamics, the bounds and the waypoints at consecutive time steps.
#
# For a linear system, a linear program computes the least relaxation that makes these conditions feasible. For a
# nonlinear system, boxes around the reachable states show values that cannot be reached. Linear programs and boxes are
# computed in plain float64 and may be wrong; the checker decides.

_MOST_UNKNOWNS = 2000
"""Most unknowns (states and inputs of all steps) of a linear program. Leaving out further steps only relaxes it."""


@dataclass(frozen=True, eq=False)
class Steps:
    """The dynamics and bounds of a plant, and required `values`, at the times `start` + k T_s [s] for k < `count`.

    The vector of all unknowns is (x_0, u_0, x_1, u_1, …). `rows` are those of the state set and of the input set at
    each step, then one for each of the `values`; `ends` has the lower and the upper bound of each.
    """

    plant: ConstrainedSystem
    start: float
    count: int
    values: tuple[Value, ...] = ()

    @property
    def rows(self) -> scipy.sparse.csr_array:
        """The matrix that maps all unknowns to the r bounded sums, sparse, of shape (r, count · (n + m))."""
        X, U = self.plant.state_set.rows, self.plant.input_set.rows
        bounded = scipy.sparse.kron(scipy.sparse.eye_array(self.count), scipy.linalg.block_diag(X, U))
        names = self.plant.names
        at = np.array([value.step * len(names) + names.index(value.name) for value in self.values], dtype=int)
        unit_rows = scipy.sparse.eye_array(self.count * len(names), format="csr")[at]
        return scipy.sparse.csr_array(scipy.sparse.vstack([bounded, unit_rows]))

    @cached_property
    def ends(self) -> Array:
        """The lower and the upper bounds of all rows, at exact times start + k T_s: shape (2, r)."""
        start, T = Fraction(self.start), Fraction(self.plant.sampling_time)
        rows = (*self.plant.state_set.checked.rows, *self.plant.input_set.checked.rows)
        found = [ends_at(row, start + k * T) for k in range(self.count) for row in rows]
        given = [(value.lower, value.upper) for value in self.values]
        return np.array([*found, *given], dtype=float).reshape(-1, 2).T

    @property
    def order(self) -> npt.NDArray[np.intp]:
        """The index of each row's waypoint in `values`; negative for the rows of X and U. Shape (r,)."""
        return np.arange(len(self.values) - self.ends.shape[1], len(self.values))

    @cached_property
    def scales(self) -> Array:
        """How far each state and input may move within the bounds, 1 if it has none: (n + m,)."""
        return np.append(unit_scales(self.plant.state_set), unit_scales(self.plant.input_set))

    @property
    def widths(self) -> Array:
        """The width of each row's bounds; for a waypoint, that of the state's or input's bounds."""
        scale = dict(zip(self.plant.names, self.scales.tolist(), strict=True))
        widths: Array = self.ends[1] - self.ends[0]
        widths[self.order >= 0] = [scale[value.name] for value in self.values]
        return widths

    def time(self, step: int) -> float:
        """Return the time of a step [s]."""
        return self.start + step * self.plant.sampling_time

    def text(self, value: Value) -> str:
        """Return the text "name = number at t = … s" about a value; the number is the middle of its bounds."""
        return f"{value.name} = {(value.lower + value.upper) / 2:.6g} at t = {self.time(value.step):.6g} s"


def steps_of(plant: ConstrainedSystem, claim: Claim, pinned: Iterable[Waypoint]) -> Iterator[Steps]:
    """Group waypoints, sorted by time, whose times are whole steps apart, and yield the claimed steps for each group.

    Without waypoints, yield the steps from the start of the claim, once.

    No equation of the system couples waypoints of different groups, only the kernel does. Times count as whole steps
    apart if their distance differs from whole steps by less than `WINDOW` steps, as a waypoint is proved in a short
    window around its time.
    """
    step, most = plant.sampling_time, _MOST_UNKNOWNS // len(coordinates(plant))
    first, last = claim.span
    every: list[list[Waypoint]] = []
    for one in pinned:
        for others in every:
            apart = (one.time - others[0].time) / step
            if abs(apart - round(apart)) < WINDOW:
                others.append(one)
                break
        else:
            every.append([one])
    for linked in every or [[]]:
        start = linked[0].time if linked else (first if math.isfinite(first) else 0.0)
        before, after = (_whole(time, start, step, most) for time in (start - first, last - start))
        at = [round((of.time - start) / step) for of in linked]
        early = min(before, max(0, (most - max(at, default=0)) // 2))
        count = early + min(after, most - early) + 1
        values = tuple(
            Value(early + k, name, value - of.tolerances[name], value + of.tolerances[name])
            for k, of in zip(at, linked, strict=True)
            for name, value in of.values.items()
            if early + k < count
        )
        yield Steps(plant, start - early * step, count, values)


def _whole(time: float, start: float, step: float, most: int) -> int:
    """Return how many whole steps fit into a duration `time` [s], at most `most`.

    A duration that is too short only by the rounding of times near `start` [s] counts as whole steps. Otherwise a step
    after its end does not count, however near it is, because bounds do not apply there.
    """
    rounding = 4 * float(np.spacing(max(abs(start), min(time, most * step))))
    return math.floor(min((time + rounding) / step, most))


@dataclass(frozen=True, eq=False)
class Courses:
    """Trajectories x_(k+1) = A_k x_k + B_k u_k + c, as vectors v = (x_0, u_0, …, x_K, u_K), with a relaxation e ≥ 0.

    `steps` are the [A_k, B_k], shape (K, n, n + m), and `rows` is a matrix of r rows. All v satisfy
    `lower` − e `growth` ≤ `rows` v ≤ `upper` + e `growth`: e = 1 widens row i by `growth`[i]. Entries of v also have
    `bounds` (lower, upper) that are not widened, with None for no bound.
    """

    steps: Array
    c: Array
    rows: Any
    lower: Array
    upper: Array
    growth: Array
    bounds: Sequence[tuple[float | None, float | None]]

    def least_growth(self) -> tuple[float, Array] | None:
        """Return the least e for which there are such vectors, and the multipliers as `minimise` does."""
        return self.minimise(np.append(np.zeros(len(self.bounds)), 1.0), most=None)

    def minimise(self, cost: Array, most: float | None = 0.0) -> tuple[float, Array] | None:
        """Return the least cost · (v, e) for 0 ≤ e ≤ most (None: without limit), and the multipliers of the rows (r,).

        A multiplier is positive at an upper bound, and negative at a lower one. None if the program is not solved.
        """
        sparse, (K, n, size) = _scipy.sparse, self.steps.shape
        moves = sparse.bsr_array((self.steps, np.arange(K), np.arange(K + 1)), shape=(K * n, (K + 1) * size))
        equal = sparse.kron(sparse.eye_array(K, K + 1, k=1), np.eye(n, size)) - moves
        grown = -self.growth[:, None]
        limited = [sparse.hstack([of, grown]) for of in (self.rows, -self.rows)]
        found = _scipy.optimize.linprog(
            cost,
            A_ub=sparse.vstack(limited, format="csc"),
            b_ub=np.append(self.upper, -self.lower),
            A_eq=sparse.hstack([equal, np.zeros((K * n, 1))], format="csc"),
            b_eq=np.tile(self.c, K),
            bounds=[*self.bounds, (0.0, most)],
            method="highs-ds",
        )
        if found.x is None:
            return None
        at_upper, at_lower = -found.ineqlin.marginals.reshape(2, -1)
        return float(found.fun), at_upper - at_lower


@dataclass(frozen=True, eq=False)
class Least:
    """The least d ≥ 0 for which states and inputs keep all rows, of which some are relaxed by d times their width.

    `multipliers` (r,) are those of the rows, in their units: positive at upper bounds, negative at lower ones.
    `missing` is d up to the solver's tolerance; the checker proves how much of it is certain.
    """

    steps: Steps
    missing: float
    multipliers: Array

    @property
    def is_active(self) -> Flags:
        """A mask of the rows that matter: d falls if one of them is relaxed, by a part of its width. Shape (r,)."""
        price = np.abs(self.multipliers) * self.steps.widths
        return np.asarray(price > _ACTIVE * np.max(price))


def least(steps: Steps, relaxed: Flags) -> Least | None:
    """Return the least d for which all rows can be kept, if `relaxed` rows are widened by d times their width.

    `relaxed` are flags (r,). Return None if no d suffices, because rows that are not relaxed contradict each other.
    Unknowns and rows are divided by the widths of their bounds, because tolerances of solvers are absolute.
    """
    widths, scales, system, K = steps.widths, steps.scales, steps.plant.linear, steps.count - 1
    n, every = len(system.A), np.tile(scales, steps.count)
    moves = np.hstack([system.A, system.B]) * scales / scales[:n, None]
    lower, upper = steps.ends / widths
    courses = Courses(
        np.broadcast_to(moves, (K, *moves.shape)),
        system.c / scales[:n],
        scipy.sparse.diags_array(1 / widths) @ steps.rows @ scipy.sparse.diags_array(every),
        lower,
        upper,
        relaxed.astype(float),
        [(None, None)] * len(every),
    )
    found = courses.least_growth()
    return None if found is None else Least(steps, found[0], found[1] / widths)


_NOTHING = 1e-6  # part of a bound's width: violations up to this are within the tolerance of solvers
_ACTIVE = 1e-6  # relative to the largest multiplier: smaller multipliers count as 0
_PARTS = (1 - 1e-9, 1 - 1e-6, 1 - 1e-3, 0.9, 0.5, 0.1)
"""The violation that a solver finds is multiplied by each of these factors, until the checker accepts the product."""


def impossible(
    plant: ConstrainedSystem,
    claim: Claim,
    pinned: Sequence[Waypoint],
    means: Sequence[float],
    tightening: Tightening | None = None,
) -> Impossible | InfeasibleTightening | None:
    """Return bounds and waypoints that contradict each other at claimed steps; None if no contradiction is proved.

    If `plant` has bounds tightened by `tightening`, the plant with its given bounds is tried first, because only a
    contradiction of given bounds excludes every reference. Each contradiction returned is proved: it is computed in
    float64, and the checker accepts its file. The search is incomplete. It examines no times between steps, no
    vehicles, no nonlinear systems with bounds that move, and of other nonlinear systems only boxes around the reachable
    states. It is skipped if there are no waypoints (`pinned`), no bound moves, and the plant may rest at the `means` of
    its flat outputs.
    """
    if tightening is None:
        return _of_bounds(plant, claim, pinned, means)
    found = _of_bounds(tightening.given, claim, pinned, means)
    if found is None and (of_given := _of_bounds(plant, claim, pinned, means)):
        return InfeasibleTightening(
            of_given.given, of_given.missing, of_given.among, of_given.contradiction, tightening
        )
    return found


def _of_bounds(
    plant: ConstrainedSystem, claim: Claim, pinned: Sequence[Waypoint], means: Sequence[float]
) -> Impossible | None:
    is_linear = isinstance(plant.system, LinearSystem)
    if plant.moves:
        is_examined = is_linear
    else:
        is_examined = bool(pinned) or not all(q.is_kept_at_rest(means) for q in plant.quantities)
    every = steps_of(plant, claim, pinned) if is_examined else ()
    return next(filter(None, map(_of_linear if is_linear else _of_nonlinear, every)), None)


def _of_linear(steps: Steps) -> Impossible | None:
    found = _contradiction(steps)
    if found is None or found.missing <= 0:
        return None
    steps, given, missing, values = found.steps, "", found.missing, list[str]()
    if steps.values:
        *others, last = steps.values
        given, missing = steps.text(last), missing * steps.widths[-1].item()
        of_others = found.is_active[steps.order >= 0][:-1].tolist()
        values = [steps.text(value) for value, is_active in zip(others, of_others, strict=True) if is_active]
    return _accept(Impossible(given, missing, (*values, *_bounds(found)), _multipliers(found)))


def _accept(found: Impossible) -> Impossible | None:
    """Return `found` with the largest part of its relaxation `missing` that the checker accepts.

    None if the checker accepts none.
    """
    for part in _PARTS:
        missing = part * found.missing
        nearly = replace(found, missing=missing, contradiction={**found.contradiction, "missing": missing})
        if judge_contradiction(nearly) is nearly:
            return nearly
    return None


def _file(steps: Steps, first: int, count: int, proof: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a contradiction's file: the plant and the given values at `count` steps from `first` on.

    The multipliers or boxes in `proof` show how far constraints have to be relaxed at least, which `_accept` adds.
    """
    return {
        "format": FORMAT,
        "version": VERSION,
        "plant": as_written(steps.plant),
        "start": steps.time(first),
        "steps": count,
        "values": [
            {**vars(value), "step": value.step - first} for value in steps.values if first <= value.step < first + count
        ],
        "proof": proof,
    }


def _of_nonlinear(steps: Steps) -> Impossible | None:
    """Return a proof that no reachable state meets a bound or a waypoint; None if none is found.

    At each step, a box encloses all reachable states; it may also contain other states. Vehicles are not examined, as
    their headings are known only up to whole turns.
    """
    plant = a_plant(as_written(steps.plant), "plant")
    system = plant.system
    if not isinstance(system, subject.NonlinearSystem) or (system.flat and system.flat.angles):
        return None
    asked = Contradiction(
        plant, start=steps.start, steps=steps.count, values=steps.values, missing=0.0, proof=Gap(0, "")
    )
    last, before = max((value.step for value in steps.values), default=0), None
    for k, wanted in enumerate(wanted_boxes(asked, system)):
        box = {name: (float(low), float(high)) for name, (low, high) in wanted.items()}
        for name, (low, high) in box.items():
            if low > high:
                return _gap(steps, Gap(k, name), low - high)
        if k > last and box == before:
            return None
        before = box
    return None


def _gap(steps: Steps, gap: Gap, missing: float) -> Impossible | None:
    """Return the contradiction that the checker accepts for a `gap`; None if it accepts none.

    A gap names a step and a state or an input whose bound or waypoint excludes all reachable values; `missing` is the
    distance between these.
    """
    bounds = {name: extent(steps.plant, name, steps.start) for name in steps.plant.names}
    before = {(of.step, of.name): steps.text(of) for of in steps.values if of.step <= gap.step}
    bound = f"{gap.name} in {bounds[gap.name]} at t = {steps.time(gap.step):.6g} s"
    wanted = before.pop((gap.step, gap.name), bound)
    among = [*before.values(), *(f"{name} in {of}" for name, of in bounds.items() if of)]
    proof = {"kind": "boxes", **vars(gap)}
    return _accept(Impossible(wanted, missing, tuple(among), _file(steps, 0, gap.step + 1, proof)))


def _contradiction(steps: Steps) -> Least | None:
    """Solve a program for the first waypoint value that contradicts the bounds and the waypoint values before it.

    If the bounds contradict each other without any waypoint, return the program of the bounds alone. None if all rows
    are satisfied up to the tolerance of solvers.
    """
    all_values = least(steps, steps.order >= 0)
    if all_values is None:
        bounds = replace(steps, values=())
        return least(bounds, bounds.order < 0)
    if all_values.missing <= _NOTHING:
        return None
    for last in range(len(steps.values)):
        some = replace(steps, values=steps.values[: last + 1])
        found = least(some, some.order == last)
        if found is not None and found.missing > _NOTHING:
            return found
    return None


def _multipliers(found: Least) -> dict[str, Any]:
    """Return the content of a contradiction's file, from the first to the last step with a nonzero multiplier.

    The file covers at least n steps, where n is the number of states.
    """
    steps, is_bound, plant = found.steps, found.steps.order < 0, found.steps.plant
    n, r = len(plant.system.states), len(plant.state_set.rows)
    of_bounds, of_values = found.multipliers[is_bound].reshape(steps.count, -1), found.multipliers[~is_bound].tolist()
    that_matter = [value.step for value, y in zip(steps.values, of_values, strict=True) if y]
    active = [*np.flatnonzero(np.any(of_bounds, axis=1)).tolist(), *that_matter]
    first = max(0, min([*active, steps.count - n]))
    last = min(max([*active, first + n - 1]), steps.count - 1)
    within = of_bounds[first : last + 1]
    proof = {
        "kind": "multipliers",
        "states": within[:, :r].tolist(),
        "inputs": within[:, r:].tolist(),
        "values": [y for value, y in zip(steps.values, of_values, strict=True) if first <= value.step <= last],
    }
    return _file(steps, first, last + 1 - first, proof)


def _bounds(found: Least) -> Iterator[str]:
    """Yield a text for each bound in a contradiction, with the first and the last time at which it takes part."""
    steps, constraints = found.steps, found.steps.plant.given_constraints
    times: dict[tuple[bool, int], list[float]] = defaultdict(list)
    for i in np.flatnonzero(found.is_active & (steps.order < 0)).tolist():
        step, row = divmod(i, len(constraints))
        times[found.multipliers.item(i) > 0, row].append(steps.time(step))
    for (is_upper, row), at in sorted(times.items()):
        of = constraints[row]
        first, last = (of.bounds.ends(np.asarray(t))[is_upper] for t in (at[0], at[-1]))
        bound = f"{first:.6g}" + (f" to {last:.6g}" if last != first else "")
        when = f"at t = {at[0]:.6g} s" if len(at) == 1 else f"from t = {at[0]:.6g} s to {at[-1]:.6g} s"
        yield f"{of.name} ({'upper' if is_upper else 'lower'} bound {bound}) {when}"
