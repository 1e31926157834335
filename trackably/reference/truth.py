"""Bound the distance between a reference and the true signal, for every signal that can explain the samples.

Two things are known before any sample is taken: a bound ē of the sensor's error, and a bound of the signal's slope or
of its second derivative. With the samples, they confine a signal f at a time t to a lower side D(t) and an upper side
U(t), each the tightest bound that any pair of measurements gives; `trackably.checker.truth` has the formulas and their
proof. If U − ε ≤ x_r ≤ D + ε, then |x_r − f| ≤ ε for every such f. The converse holds up to the pairs of measurements
that are not examined.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any, Self

import numpy as np
import scipy

from trackably.arguments import instance, positive, real
from trackably.arrays import Array, ArrayLike, subdivide
from trackably.certificates.certificate import Certificate
from trackably.certificates.cover import discs
from trackably.certificates.form import as_subject, as_written, without_none
from trackably.certificates.judge import NotTrackableError, found_or_raise, judge_contradiction
from trackably.certificates.outcome import NoSignal, TooFar, Unproved
from trackably.checker.answers import FailedStepError
from trackably.checker.boxes import Box
from trackably.checker.certificate import AllPhases, Claim, Derived, Measured, SignalClass, TrueSignal, Window
from trackably.checker.contradiction import Value
from trackably.checker.floats.boxes import FIRST_PASS
from trackably.checker.floats.intervals import bernstein_of, stack
from trackably.checker.models import Model
from trackably.checker.quantities import states_of
from trackably.checker.truth import (
    CONTRADICTION,
    VERSION,
    ContradictedSamples,
    contradiction_of,
    extreme,
    gaps,
    places,
    side,
)
from trackably.gp.samples import Samples
from trackably.reference.feasibility import Courses, Steps, least
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import Polytope
from trackably.systems.rationals import exact, float_above
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening

_NEAR = 30
"""Pairs among this many measurements before a time and as many after it are examined; others hardly help."""

_CELLS, _TERMS = 300, 12  # about this many cells (intervals of time) for a proof; Taylor terms in each
_ROUNDING = 1e-9  # part of the largest error that is added to all errors, to cover rounding
_STEPS = 3000  # most time steps in the linear program for the least ε
_KNOTS = 4000  # most knots in linear programs for signals, unless there are more measurements


@dataclass(frozen=True)
class Truth:
    """Bounds of a sampled state's true signal f and of its sensor, known independently of the samples.

    Each sample is within `noise` of f, in the state's unit. |f(s) − f(t)| ≤ `slope` |s − t| [unit/s], and |f′(s) −
    f′(t)| ≤ `second_derivative` |s − t| [unit/s²]; give at least one of these two. `rate` names the samples that
    measure f′, each within `rate_noise` [unit/s]. Sample times are taken as exact: count a timing error as noise, the
    error times the slope. ValueError: a bound is missing, or not positive.
    """

    noise: float
    slope: float | None = None
    second_derivative: float | None = None
    rate: str | None = None
    rate_noise: float | None = None

    def __post_init__(self) -> None:
        for name in ("noise", "slope", "second_derivative", "rate_noise"):
            given = getattr(self, name)
            if given is None:
                continue
            value = (real if name == "noise" else positive)(f"truth: {name}", given)
            if value < 0:
                raise ValueError(f"truth: {name} must not be negative, got {value:g}")
            object.__setattr__(self, name, value)
        if self.slope is None and self.second_derivative is None:
            raise ValueError(
                "truth: expected a bound of the slope, of the second derivative, or of both, got none; give slope or "
                "second_derivative"
            )
        if (self.rate is None) is not (self.rate_noise is None) or (self.rate and self.second_derivative is None):
            raise ValueError(
                f"truth: expected rate and rate_noise together, with second_derivative, got rate={self.rate!r}, "
                f"rate_noise={self.rate_noise}, second_derivative={self.second_derivative}"
            )


TruthLike = Truth | Mapping[str, Truth]
Tolerance = float | Mapping[str, float] | None


def true_signals(
    truth: TruthLike | None,
    tolerance: Tolerance,
    samples: Mapping[str, Samples],
    plant: ConstrainedSystem,
    claim: Claim,
) -> tuple[ConstrainedSystem, tuple[TrueSignal, ...]]:
    """Return the plant with a bound for each `tolerance`, and for each state in `truth` what is to be proved of it.

    This is a `TrueSignal` of one cell: all times from the state's first sample to its last, or those in the window that
    is claimed. Its error is the tolerance (infinite if none is given).

    For each state x with a tolerance ε, the plant has one more bound U(t) − ε ≤ x(t) ≤ D(t) + ε at these times, where U
    and D are the upper and the lower bound of the possible signals. If ε is hardly larger than the least possible
    error, this bound is left out, because learning would hardly succeed; `with_truth` then shows whether the reference
    is within ε. TypeError or ValueError: `truth` does not fit the samples, the plant or the claim; a tolerance is no
    positive number, is of another state, or all phases are claimed. NotTrackableError: no signal of a class explains
    its samples, or a tolerance is too small for every reference.
    """
    if truth is not None and not isinstance(truth, Mapping):
        truth = {next(iter(samples)): truth}
    found = {name: _sought(name, of, samples, plant, claim) for name, of in (truth or {}).items()}
    for name, sought in found.items():
        found_or_raise(no_signal(name, sought.of))
    if tolerance is None:
        return plant, tuple(found.values())
    if not found or isinstance(claim, AllPhases):
        raise ValueError(
            "tolerance: give truth= of a sampled state too, and claim a window or all times t ≥ 0; got "
            f"{'the claim of all phases' if found else 'no truth='}"
        )
    for name, given in (tolerance if isinstance(tolerance, Mapping) else dict.fromkeys(found, tolerance)).items():
        if name not in found:
            raise ValueError(f"tolerance: expected a state that truth= describes, {', '.join(found)}, got {name}")
        most = positive(f"tolerance of {name}", given)
        known = _middle(found[name])
        least = max(known.error, _least_error(plant, known))
        if not most > least:
            raise NotTrackableError(TooFar(name, most, least, _radius(known)))
        found[name] = replace(found[name], errors=(most,), derived=known.derived)
        if _SHARE * most > least:  # otherwise nothing is imposed, as the search may hardly find a reference within it
            plant = _with_row(plant, known, _SHARE * most)
    return plant, tuple(found.values())


def _sought(
    name: str, truth: object, samples: Mapping[str, Samples], plant: ConstrainedSystem, claim: Claim
) -> TrueSignal:
    """Return the claim about the distance of a state from its true signal, as one cell with all claimed times.

    Its error, upper and lower bounds are still to be found. Errors as for `true_signals`.
    """
    instance(f"truth of {name}", truth, Truth, "a Truth(noise=…, slope=… or second_derivative=…)")
    assert isinstance(truth, Truth), "instance has refused anything else"
    if not isinstance(plant.system, LinearSystem):
        raise ValueError(
            "truth: expected a plant with a linear system, whose states can be compared with true signals, got a "
            "nonlinear system"
        )
    if name not in plant.system.states:
        raise ValueError(f"truth: expected names of states, {', '.join(plant.system.states)}, got {name}")
    for sampled in filter(None, (name, truth.rate)):
        if sampled not in samples:
            raise ValueError(f"truth: {sampled} is not sampled; there are samples of {', '.join(samples)}")
    rates = _measure(samples[truth.rate], truth.rate_noise or 0.0) if truth.rate else None
    of = SignalClass(_measure(samples[name], truth.noise), rates, truth.slope, truth.second_derivative)
    first, last = start, end = of.samples.times[0], of.samples.times[-1]
    if isinstance(claim, Window):
        start, end = max(start, claim.start), min(end, claim.end)
    if not start < end:
        raise ValueError(
            f"truth: expected a claim with times between the first and the last of several samples of {name}, got "
            f"samples from {first:g} s to {last:g} s and the claim of {claim}"
        )
    return TrueSignal(name, of, (start, end), (), 0, (), (), (float("inf"),))


def _measure(samples: Samples, noise: float) -> Measured:
    return Measured(tuple(samples.times.tolist()), tuple(samples.values.tolist()), noise)


# Upper and lower sides of a class of signals, in float64: the checker computes them again in rational arithmetic.


def _points(known: TrueSignal) -> Array:
    """Return the points near which every signal of the class passes: samples, and derived points (bounds at one time).

    The rows of the result (4, P) are times [s] in increasing order, the largest distances of a signal from the values,
    the values, and the numbers of the points. Of points at one time, only the one with the least distance is returned.
    """
    rows = [(float(t), float(noise), float(y), i) for i, (t, y, noise) in places(known).items()]
    points = np.array(sorted(rows))
    return points[np.unique(points[:, 0], return_index=True)[1]].T


def _pair_bounds(of: SignalClass, times: Array, points: Array) -> tuple[Array, Array, Array]:
    """Return pairs (P, 2) of nearby measurements, and the upper and lower bounds (P, T) that they give of the signal.

    The bounds are those at times (T,) [s]; no measurement may lie between these times. `points` are those of the class.
    """
    middle, n, M = float(np.mean(times)), len(of.samples.times), of.second_derivative
    at, noise, y, ids = points[:, _around(points[0], middle), None]
    parts, since = [], np.abs(times - at)
    if of.slope is not None:
        parts.append((ids, ids, y + 0 * times, noise + of.slope * since))
    if M is not None:
        a, b = np.triu_indices(len(at), 1)
        part = (times - at[a]) / (at[b] - at[a])
        slack = noise[b] * np.abs(part) + noise[a] * np.abs(1 - part) + M / 2 * since[a] * since[b]
        parts.append((ids[a], ids[b], y[a] * (1 - part) + y[b] * part, slack))
    if M is not None and of.rates:
        a, b = (each.ravel() for each in np.meshgrid(np.arange(len(at)), _around(of.rates.times, middle)))
        s, v = (np.array(of_each)[b, None] for of_each in (of.rates.times, of.rates.values))
        way = np.abs((times - s) * np.abs(times - s) - (at[a] - s) * np.abs(at[a] - s)) / 2
        slack = noise[a] + of.rates.noise * since[a] + M * way
        parts.append((ids[a], n + b[:, None], y[a] + v * (times - at[a]), slack))
    i, j, value, slack = map(np.concatenate, zip(*parts, strict=True))
    return np.hstack([i, j]).astype(int), value + slack, value - slack


def _around(times: ArrayLike, middle: float, count: int = _NEAR) -> Any:
    """Return the indices of the last `count` times before `middle` [s], and of the first `count` at or after it."""
    return np.arange(np.size(times))[max(0, (place := int(np.searchsorted(times, middle))) - count) : place + count]


def sides_at(known: TrueSignal, times: Array) -> tuple[Array, Array]:
    """Return the least upper bound U and the largest lower bound D of a class's signals at `times` (T,) [s]: (T,) each.

    They follow from pairs of nearby measurements and derived points.
    """
    points = _points(known)
    found = [_pair_bounds(known.of, np.array([t]), points) for t in times.tolist()]
    return np.array([upper.min() for _, upper, _ in found]), np.array([lower.max() for _, _, lower in found])


# Upper bounds of the distance between a reference and all true signals, one for each cell (interval of time).


def true_signal(reference: Reference, sought: TrueSignal, robust: Tightening | None = None) -> TrueSignal:
    """Return the claim `sought`, which names a state, a class of signals and times, with proposed bounds of its errors.

    An error is the distance between the state of the reference, a sum of kernels, and every signal of the class. If the
    plant is disturbed (`robust`), the distance of the plant's state at sampling instants is bounded too. ValueError: no
    bound is found.
    """
    state, subject = reference.plant.system.states.index(sought.state), as_subject(reference)
    found = _with_sides(sought, _CELLS, lambda t: reference.state_at(t)[:, :, state])
    ends = np.array(found.ends)
    radii = discs(subject, reference, [states_of(subject)[state]], ends[:-1], ends[1:], _TERMS)
    found = replace(found, radii=tuple(radii.tolist()), terms=_TERMS)
    errors = np.array([max(map(_largest, models)) for models in gaps(subject, found, FIRST_PASS)])
    if not np.all(np.isfinite(errors)):
        raise ValueError(
            f"truth: no bound was found for the distance between the reference's {found.state} and its true signals at "
            "some times between the samples"
        )
    errors = np.maximum(errors, 0.0)
    errors += np.max(errors) * _ROUNDING or _ROUNDING
    proved = replace(found, errors=tuple(errors.tolist()))
    if robust is None:
        return proved
    row = exact(np.eye(1, len(robust.given.system.states), state)[0]).tolist()
    return replace(proved, plant=float_above(Fraction(proved.error) + max(robust.taken_from("state", row))))


def _with_sides(known: TrueSignal, count: int, values: Callable[[Array], Array]) -> TrueSignal:
    """Return `known` cut into about `count` cells (intervals of time), with upper and lower bounds of the signal.

    The two bounds in a cell are given by pairs of measurements. `values` returns values x at times [s] of each cell;
    both have shape (cells, T). The error of a cell is the largest distance between x and one of the bounds. Many
    measurements together bound a signal more tightly than two. So at the ends of the cells with the largest errors,
    linear programs combine all nearby measurements. Their results are more derived points (bounds at one time).
    """
    edges, asked = _edges(known, count), {d.time for d in known.derived}
    times = np.linspace(edges[:-1], edges[1:], 5, axis=1)
    x, ends, apart = values(times), times[:, [0, -1]].tolist(), np.zeros(len(times))
    found: list[Any] = [None] * len(times)
    changed = {*range(len(times))}
    while True:
        points = _points(known)
        for k in changed:
            pairs, upper, lower = _pair_bounds(known.of, times[k], points)
            furthest = [np.max(side, axis=1) for side in (upper - x[k], x[k] - lower)]
            found[k] = [tuple(pairs[np.argmin(of_pairs)].tolist()) for of_pairs in furthest]
            apart[k] = max(map(np.min, furthest))
        worst = [k for k in np.flatnonzero(apart >= _WORST * np.max(apart)).tolist() if not asked.issuperset(ends[k])]
        if known.of.second_derivative is None or len(known.derived) >= _DERIVED or not worst:
            above, below = zip(*found, strict=True)
            return replace(known, ends=tuple(edges.tolist()), upper=above, lower=below)
        new = {t for k in worst[:_AT_ONCE] for t in ends[k]} - asked
        asked |= new
        derived = filter(None, (_derive(known.of, t) for t in sorted(new)))
        known = replace(known, derived=(*known.derived, *derived))
        changed = {j for k in worst[:_AT_ONCE] for j in range(max(0, k - 2), min(len(times), k + 3))}


_WORST, _AT_ONCE, _DERIVED, _BESIDE = 0.95, 10, 120, 12
"""Derived points (bounds at one time, by linear programs) are computed at the ends of the cells whose error is at least
the part _WORST of the largest error, for _AT_ONCE cells in a round, until there are _DERIVED points. Each is computed
from _BESIDE measurements on each side.
"""


def _derive(of: SignalClass, t: float) -> Derived | None:
    """Return bounds of a signal at a time [s] from nearby measurements, by the multipliers of linear programs.

    None if a program has no solution, or there are too few measurements.
    """
    n = len(of.samples.times)
    parts = [_around(of.samples.times, t, _BESIDE), n + _around(of.rates.times if of.rates else (), t, _BESIDE)]
    which = np.concatenate(parts).tolist()
    some = replace(_only(of, which), slope=None)
    sides = [_extreme(some, t, sign) for sign in (1, -1)]
    return Derived(t, *(tuple((which[i], m) for i, m in side) for side in sides if side)) if all(sides) else None


def _extreme(of: SignalClass, t: float, sign: int) -> tuple[tuple[int, Fraction], ...] | None:
    """Return the multipliers that bound a signal from above at a time [s]; from below for `sign` −1.

    A linear program over signals is solved on finer and finer grids, until the bound that its multipliers prove is near
    the value of a signal that it found. None if there are too few samples, or no program is solved.
    """
    found = None
    for cells in _FINER:
        signals = Signals.of(of, (t,), cells)
        solved = signals.extreme(t, sign)
        if solved is None:
            continue
        value, prices = solved
        multipliers = _rationals(of, sign * prices, 1, Fraction(t))
        if multipliers is None:
            return None
        found = tuple((i, m) for i, m in enumerate(multipliers) if m)
        bound = extreme(of, Derived(t, found, found), sign)
        if bound is None or sign * (float(bound) - value) <= _GAP * signals.unit:
            break
    return found


_GAP = 0.05  # part of the noise: a bound at a derived point is precise enough if some signal is this near to it
_FINER = 4, 16, 64  # cells between measurements, tried in turn: if few signals are in a class, a coarse grid has none


def _rationals(of: SignalClass, multipliers: Array, total: int, moment: Fraction) -> list[Fraction] | None:
    """Return rational multipliers μ_i of samples and ν_j of rates, near the given ones, with Σ μ_i = total exactly.

    If the second derivative is bounded, Σ μ_i t_i + Σ ν_j = moment too, so that the weighted sum of any straight line's
    values is fixed. None if there are too few samples.
    """
    n, times = len(of.samples.times), [Fraction(s) for s in of.samples.times]
    exact = [
        Fraction(round(m * 2**40), 2**40) if abs(m) > _NO_MULTIPLIER else Fraction(0) for m in multipliers.tolist()
    ]
    used = [i for i in range(n) if exact[i]]
    first, last = (used[0], used[-1]) if len(used) > 1 else (0, n - 1)
    if first >= last:
        return None
    if of.second_derivative is None:
        exact[first] += total - sum(exact)
        return exact
    exact[first] = exact[last] = Fraction(0)
    left = total - sum(exact[:n])
    short = moment - sum(m * s for m, s in zip(exact, times, strict=False)) - sum(exact[n:])
    exact[last] = (short - left * times[first]) / (times[last] - times[first])
    exact[first] = left - exact[last]
    return exact


_NO_MULTIPLIER = 1e-9  # a multiplier whose absolute value is at most this counts as 0


def _edges(known: TrueSignal, count: int) -> Array:
    """Return the ends of the cells [s] in which the distance to the true signal is bounded.

    They are the ends of `known` and all times of samples and of derived points between these. If there are no more than
    `count` of them, times in between are added.
    """
    start, end = known.ends
    of, rates = known.of.samples, known.of.rates
    ends = np.unique([start, end, *of.times, *(rates.times if rates else ()), *(d.time for d in known.derived)])
    ends = ends[(start <= ends) & (ends <= end)]
    widest = (end - start) / count
    return ends if len(ends) > count else subdivide(ends, np.ceil(np.diff(ends) / widest).astype(int))


def _largest(gap: Model | None) -> float:
    """Return an upper bound of all values that the Taylor model `gap` encloses; infinite for None.

    A gap is the distance between the reference and an upper or lower bound of the true signal, in one cell.
    """
    if gap is None:
        return float("inf")
    return float(np.max(bernstein_of(stack(gap.coefficients, (1,))).high)) + float(gap.missed.b)


# Linear programs over the signals of a class whose highest bounded derivative is piecewise constant.


@dataclass(frozen=True, eq=False)
class Signals(Courses):
    """The signals of a class as trajectories of values, and of slopes if the second derivative is bounded.

    The highest derivative is constant between two `knots` [s]. Values are divided by `unit`, the noise of the samples
    (if this is zero, a part of their range).
    """

    knots: Array
    unit: float

    @classmethod
    def of(cls, of: SignalClass, also: tuple[float, ...] = (), cells: int = 4) -> Self:
        """Return the signals of the class `of` that are polynomials between two knots, for linear programs.

        Knots are the times of the class's samples and rates, the times `also` [s], and `cells` − 1 times between two
        neighbours of these, fewer if there are many.
        """
        every = [of.samples, *([of.rates] if of.rates else [])]
        own = np.unique([*also, *(t for measured in every for t in measured.times)])
        knots = subdivide(own, max(1, min(cells, _KNOTS // max(1, len(own)))))
        unit = of.samples.noise or max(float(np.ptp(of.samples.values)) * 1e-3, 1e-9)
        limits = [
            (None, None) if bound is None else (-bound / unit, bound / unit)
            for bound in (of.slope, of.second_derivative)
        ]
        h = np.diff(knots)
        one = np.ones(len(h))
        # States are values and slopes; without a bound of the second derivative, slopes are constant between two knots.
        moves = [[one, h]] if of.second_derivative is None else [[one, h, h**2 / 2], [0 * h, one, h]]
        n = len(moves)
        bounds = [(None, None), *limits[:n]] * len(knots)
        at = [(n + 1) * np.searchsorted(knots, measured.times) + order for order, measured in enumerate(every)]
        values = np.concatenate([measured.values for measured in every]) / unit
        noise = np.concatenate([np.full(len(measured.times), measured.noise) for measured in every]) / unit
        rows = scipy.sparse.eye_array(len(bounds), format="csr")[np.concatenate(at)]
        growth = np.where(noise > 0, noise, 1.0)
        steps = np.moveaxis(np.array(moves), 2, 0)
        return cls(steps, np.zeros(n), rows, values - noise, values + noise, growth, bounds, knots, unit)

    def extreme(self, t: float, sign: int) -> tuple[float, Array] | None:
        """Return the largest value of all signals at the knot t [s], and the multipliers of the measurements.

        For `sign` −1, it is the least value. None if it is not found.
        """
        cost = np.zeros(len(self.bounds) + 1)
        cost[self.steps.shape[2] * int(np.searchsorted(self.knots, t))] = -sign
        found = self.minimise(cost)
        return found and (-sign * found[0] * self.unit, found[1])


def no_signal(name: str, of: SignalClass) -> NoSignal | None:
    """Return a proof, accepted by the checker, that no signal of a class explains its samples; None if none is found.

    The bounds of the slope and of the second derivative are examined separately.
    """
    curved, steep = replace(of, slope=None), replace(of, second_derivative=None, rates=None)
    alone = [(of.second_derivative, curved), (of.slope, steep)]
    found = (_contradiction(name, each) for bound, each in alone if bound is not None)
    return next(filter(None, found), None)


def _contradiction(name: str, of: SignalClass) -> NoSignal | None:
    coarse = _contradicting(of, 4)
    if coarse is None:
        return None
    which = np.flatnonzero(coarse).tolist()
    for k in list(which):  # leave out each measurement that the contradiction does not need
        fewer = [i for i in which if i != k]
        if fewer and _contradicting(_only(of, fewer), 16) is not None:
            which = fewer
    some = _only(of, which)
    multipliers = _contradicting(some, 64)
    exact = None if multipliers is None else _rationals(some, multipliers, 0, Fraction(0))
    if exact is None:
        return None
    n = len(some.samples.times)
    found = ContradictedSamples(some, tuple(exact[:n]), tuple(exact[n:]))
    try:
        excess, weight, size, bound = contradiction_of(found)
    except FailedStepError:
        return None
    missing = float(excess / weight) if weight else 0.0
    among = [
        f"{what} {y:.6g} at t = {t:.6g} s"
        for what, measured in ((f"{name} =", some.samples), ("rate", some.rates))
        if measured
        for t, y in zip(measured.times, measured.values, strict=True)
    ]
    written = {name: value for name, value in without_none(as_written(found)).items() if value}
    content = {"format": CONTRADICTION, "version": VERSION, **written}
    answer = NoSignal(name, missing, tuple(among), content, bound, float(excess / size))
    return answer if judge_contradiction(answer) is answer else None


def _contradicting(of: SignalClass, cells: int) -> Array | None:
    """Return the multipliers of all measurements if some contradict each other, 0 for the others; samples come first.

    They are scaled so that the largest absolute value is 1. None if no contradiction is found.
    """
    found = Signals.of(of, cells=cells).least_growth()
    if found is None or found[0] <= _LEAST_GROWTH:
        return None
    multipliers = -found[1] / np.max(np.abs(found[1]))
    return np.where(np.abs(multipliers) > _NO_MULTIPLIER, multipliers, 0.0)


_LEAST_GROWTH = 1e-6  # measurements contradict each other if their noise bounds must grow by more than this part


def _only(of: SignalClass, which: list[int]) -> SignalClass:
    """Return the class with only the measurements whose indices are in `which`; indices count samples, then rates."""
    n = len(of.samples.times)

    def some(measured: Measured, at: list[int]) -> Measured:
        times, values = (tuple(each[i] for i in at) for each in (measured.times, measured.values))
        return replace(measured, times=times, values=values)

    samples, rates = [i for i in which if i < n], [i - n for i in which if i >= n]
    return replace(of, samples=some(of.samples, samples), rates=some(of.rates, rates) if of.rates and rates else None)


# The tolerance of a reference as bounds that move in time.

_SHARE = 0.98  # this part of a tolerance is imposed; the other part covers the estimates of the proof
_WIDER = 100.0  # before the first sample and after the last, bounds are further out by this number of widths
_FEWER = 100  # about this many cells, in which moving bounds are polynomials; more if there are more measurements


def _middle(sought: TrueSignal) -> TrueSignal:
    """Return `sought` cut into cells (intervals of time), with upper and lower bounds of the true signal in each.

    The error of a cell is half of the largest distance between the two bounds: that of a reference in their middle.
    """
    found = _with_sides(sought, _FEWER, lambda t: np.mean(sides_at(sought, t.ravel()), axis=0).reshape(t.shape))
    high, low = _sides(found)
    apart = np.polynomial.polynomial.polyval(np.linspace(-1.0, 1.0, 65), (high - low).T)
    return replace(found, errors=tuple((np.max(apart, axis=1) / 2).tolist()))


def _sides(of: TrueSignal) -> Array:
    """Return the upper and the lower bound of the true signal in each cell, as quadratic polynomials of x ∈ [−1, 1].

    Coefficients have shape (2, cells, 3), the constant ones first.
    """
    every, boxes = places(of), [Box(*ends, 1.0) for ends in pairwise(of.ends)]
    return np.array(
        [
            [side(of.of, pair, sign, box, every) for pair, box in zip(pairs, boxes, strict=True)]
            for pairs, sign in ((of.upper, 1), (of.lower, -1))
        ],
        dtype=float,
    )


def _with_row(plant: ConstrainedSystem, of: TrueSignal, tolerance: float) -> ConstrainedSystem:
    """Return the plant with one more bound U − ε ≤ x ≤ D + ε of the state x that `of` names, with ε = `tolerance`.

    U and D are the upper and the lower bound of the true signal, which move in time. Before the first sample of the
    state and after the last, the new bound is so wide that it never matters.
    """
    ends = np.array(of.ends)
    in_time = np.array([[1, 0, 0], [-1, 1, 0], [1, -2, 1]])  # powers of x, in those of y with x = y − 1
    low, high = _sides(of) @ in_time * (2 / np.diff(ends)[:, None]) ** [0, 1, 2]
    low[:, 0] -= tolerance
    high[:, 0] += tolerance
    X, i = plant.state_set, plant.system.states.index(of.state)
    hull, far = X.hull.extent(i), _WIDER * float(np.max(high[:, 0]) - np.min(low[:, 0]))
    beyond = [hull.lower, hull.upper] if hull else []
    least, most = min([np.min(low[:, 0]) - far, *beyond]), max([np.max(high[:, 0]) + far, *beyond])
    times = [2 * ends[0] - ends[1], *ends, 2 * ends[-1] - ends[-2]]
    own = [
        PolynomialPieces(times, [[value, 0.0, 0.0], *pieces, [value, 0.0, 0.0]])
        for pieces, value in ((low, least), (high, most))
    ]
    lower, upper = ([*given, side] for given, side in zip(X.ends, own, strict=True))
    return replace(plant, state_set=Polytope(np.vstack([X.rows, np.eye(1, X.dimension, i)]), lower, upper, X.dimension))


# Lower limits for the error of any reference.


@dataclass(frozen=True)
class Accuracy:
    """How far a reference is from the true signal, and how close any other could be, in the state's unit.

    `error` is the proved bound ε of the reference. `plant` is that of the disturbed plant at sampling instants, None if
    the plant is not disturbed. `radius` is a lower bound of the worst-case error of any estimate: half the distance of
    two signals that both explain the samples (radius of information). `least` is the smallest ε that a linear program
    finds for a reference that the plant can follow at sampling instants, with the same bounds of the true signal.
    """

    error: float
    plant: float | None
    radius: float
    least: float

    def __str__(self) -> str:
        plant = "" if self.plant is None else f", the plant within {self.plant:.4g} at steps"
        return (
            f"within {self.error:.4g} of the true signal{plant}; no estimate is always nearer than {self.radius:.4g}, "
            f"and no reference that can be followed is proved nearer than {self.least:.4g}"
        )


def accuracy(certificate: Certificate, name: str | None) -> Accuracy:
    """Return the proved error bound of a state, and lower limits for all other references and estimates.

    Without a name, the state is the first one with a truth.

    ValueError: the certificate says nothing about the true signal of this state.
    """
    truth = next((truth for truth in certificate.truth if name in (None, truth.state)), None)
    if truth is None:
        raise ValueError(
            f"accuracy: the certificate has no true signal of {name or 'any state'}; give truth= to learn_reference"
        )
    return Accuracy(truth.error, truth.plant, _radius(truth), _least_error(certificate.reference.plant, truth))


def _radius(truth: TrueSignal) -> float:
    """Return half the distance of the two most distant signals that explain the samples, by linear programs in float64.

    They are compared at one time: that at which the upper and the lower bound of all signals are furthest apart.
    Return 0 if no program is solved.
    """
    times = subdivide(np.array(truth.ends), 2)
    upper, lower = sides_at(truth, times)
    widest = float(times[int(np.argmax(upper - lower))])
    for cells in _FINER:
        signals = Signals.of(truth.of, (widest,), cells)
        high, low = (signals.extreme(widest, sign) for sign in (1, -1))
        if high and low:
            return max(0.0, (high[0] - low[0]) / 2)
    return 0.0


def _least_error(plant: ConstrainedSystem, truth: TrueSignal) -> float:
    """Return the least error bound ε of any state sequence x(t_0 + k T) that the plant can follow.

    NaN if none is computed.
    """
    T, start = plant.sampling_time, truth.ends[0]
    count = min(_STEPS, int((truth.ends[-1] - start) / T) + 1)
    upper, lower = sides_at(truth, start + T * np.arange(float(count)))
    sides = zip(upper.tolist(), lower.tolist(), strict=True)
    steps = Steps(plant, start, count, tuple(Value(k, truth.state, *of) for k, of in enumerate(sides)))
    found = least(steps, steps.order >= 0)
    return float("nan") if found is None else found.missing * float(steps.widths[-1])


def with_truth(certificate: Certificate, signals: Iterable[TrueSignal]) -> Certificate:
    """Return the certificate with proved distances between states and their true signals, for the claims in `signals`.

    NotTrackableError: a state is not proved to be within its tolerance, the error that is claimed.
    """
    found = list[TrueSignal]()
    for sought in signals:
        truth, most = true_signal(certificate.reference, sought, certificate.robust), sought.error
        if (error := max(truth.error, truth.plant or 0.0)) > most:
            worst, bounds = int(np.argmax(truth.errors)), Interval(-most, most)
            box, why = (truth.ends[worst], truth.ends[worst + 1]), "a larger tolerance is needed"
            what = f"deviation of {truth.state} from its true signals"
            raise NotTrackableError(Unproved(what, bounds, box, error - most, why))
        found.append(truth)
    return replace(certificate, truth=tuple(found)) if found else certificate
