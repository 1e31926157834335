"""The function for given hyperparameters that satisfies its bounds at all times, by an exchange method.

Solve with bounds at few places (a place is a time and a side), add the places where the result violates a bound,
repeat.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.row_posterior import MANY_ROWS, has_system
from trackably.gp.signal import KernelSum
from trackably.learning.constraint import Constraint, joined, worst
from trackably.learning.joint.constrained_mean import ConstrainedMean, constrained_mean, is_linear
from trackably.learning.joint.places import MarginScan, Places, merge, near_to
from trackably.learning.joint.sequential import with_regular
from trackably.learning.problem import MANY_CONTACTS, ConstrainedProblem, gap_allowed
from trackably.systems.trajectories import Signals

# Limits of an exchange. A back-off tightens the bounds: a later, larger one removes small violations that are left.
# Most programs in an exchange, for linear plants and for nonlinear ones: there, one is usual, and each takes long.
_MAX_ROUNDS, _MOST_WITH_FORMULAS = 40, 10
_GLANCE = 3  # most programs in an exchange that is only a glance
# Functions may violate their bounds by this part of the width before a minimum is reached. Solutions with kinks or with
# large rounding errors may do so too: a larger back-off (tightening of the bounds) removes these violations later.
ALMOST = 3e-3
_SAME_TIME = 3e-4  # part of a correlation time: closer times of bounds count as one; violations between them are small
_JUMPED = 0.1  # part of a width: a larger violation shows that the minimiser jumped to another local minimum
_MOST_JUMPS = 2  # the exchange ends after this many programs whose minimisers jumped: more bounds hardly help then
_OF_BACKOFF = 0.25  # violations up to this part of a larger back-off (tightening) are left to be removed by it
_CLOSE = 0.05  # part of a width: bounds on a smooth function are imposed at minima with smaller margins
_HELD = 0.9  # part of the back-off: bounds on a function with kinks are imposed at times with smaller margins
# Regular times between two samples at which margins of functions with kinks are examined, in coarse and other exchanges
_FEW_BETWEEN, _BETWEEN = 2, 10
_FAR = 3.0  # a larger back-off is worth another search only if it exceeds the present one by more than this factor
_NO_GAIN = 1e-9  # part of the price: if a program raises the price by less, violations are not worth another program


@dataclass(frozen=True)
class ExchangeResult:
    """The function `mean`, the `places` for a next program, and the places at which bounds are `active`.

    A place is a time and a side of a bound. `margin` is the smallest relative margin of the function. It is the margin
    of the constraint with the index `constraint`, at `time` [s].
    """

    mean: ConstrainedMean
    places: Places
    active: Places
    margin: float
    constraint: int
    time: float


def exchange_bounds(
    problem: ConstrainedProblem,
    posterior: JointPosterior,
    places: Places,
    near: Signals | None = None,
    tolerance: float = 0.0,
    ceiling: float = np.inf,
    is_glance: bool = False,
) -> ExchangeResult | None:
    """Return the function that satisfies all bounds at all times of their index sets, or the last one of the exchange.

    Each round solves a program with bounds at its `places` (times and sides), and adds places where the solution
    violates these bounds (see `_to_impose`). With nonlinear formulas, the first program starts at the signals `near`.
    The exchange ends when
    - no bound is violated by more than `tolerance` (a part of its width), or all violations are so small that a later,
      larger back-off removes them,
    - the bounds contradict each other,
    - the price D (cost of the bounds) exceeds the `ceiling`, as more places would only raise it,
    - a round adds no place, or hardly raises D (without kinks),
    - a bound on a nonlinear formula is violated by more than a tenth of its width for the second time, or
    - 40 programs are solved, with nonlinear formulas 10. If the exchange is only a glance (`is_glance`), 3 programs
      with bounds at few times show about where they are active.

    None if not even the first program has a solution, which may happen with nonlinear formulas. Raises IllConditioned
    if K + σ_n² I has no Cholesky factor.
    """
    best: ExchangeResult | None = None
    jumps = 0
    price, same, is_convex = -np.inf, same_time(posterior.signals), is_linear(problem)
    is_rough = not is_smooth(problem)
    merges = is_convex and not is_rough
    # Row systems solve programs with all regular times in linear time. Other searches have fewer times until their end.
    is_fast = has_system(posterior, MANY_ROWS) and not problem.required
    below, regular = _to_impose(problem, is_glance or (tolerance > 0 and bool(problem.prior.learned) and not is_fast))
    if not is_convex:  # times of bounds, found for other hyperparameters, may be too far apart: add regular ones
        places = with_regular(problem, posterior, places)
    kept: Places | None = None
    for _ in range(_GLANCE if is_glance else _MAX_ROUNDS if is_convex else _MOST_WITH_FORMULAS):
        bent = constrained_mean(problem, posterior, places, near, places if is_rough else kept)
        if bent is None:
            return best
        seen = MarginScan(problem.constraints, bent.signals)
        minima = seen.closest(places)
        least, gain, price = worst(minima)[0], bent.price - price, bent.price
        removed = _removed_by_backoff(problem, bent, is_rough) if is_convex else 0.0
        if merges:
            same = same_time(posterior.signals, max(removed, tolerance))
        is_stuck = abs(gain) <= _NO_GAIN * price
        # Violations between kinks are searched only after larger ones are removed: before, there would be thousands. No
        # exchange ends with small violations before this search, because those between kinks may be large.
        if least >= (-max(removed, tolerance or ALMOST) if is_rough else 0.0):
            minima = seen.with_overlooked(minima)
        margin, constraint, time = worst(minima)
        kept = bent.demanded.select(bent.multipliers != 0, len(problem.constraints))
        found = joined(minima, seen.at(regular)) if regular else minima
        new = at_steps(problem, seen.places(found, below), places, same)
        # Places with inactive bounds are dropped, unless this would go on for ever: with kinks, when D stays the same.
        met = merge(kept if is_convex and not (is_rough and is_stuck) else places, new, same)
        ends = is_stuck or all(map(np.array_equal, met, places))
        if merges and ends and margin < -max(tolerance, removed, ALMOST):
            # The function crosses a bound near a time at which it meets it: the bound has to be met there too.
            merges, is_stuck, same = False, False, same_time(posterior.signals)
            met = merge(kept, seen.places(minima, below), same)
        best = ExchangeResult(bent, met, kept, margin, constraint, time)
        jumps += not is_convex and margin < -_JUMPED
        if (
            margin >= -max(tolerance, removed)
            or bent.contradicts
            or price > ceiling
            or jumps >= _MOST_JUMPS
            or (is_stuck and not is_rough)
            or all(map(np.array_equal, met, places))
        ):
            return best
        places = met
        if is_convex or margin >= -_JUMPED:
            near = bent.signals
    return best


def _to_impose(problem: ConstrainedProblem, is_coarse: bool) -> tuple[list[float], list[Array]]:
    """Return, for each constraint, the margin below which its bounds are imposed, and regular times to examine [s].

    Margins are parts of a width. They are compared at local minima and, if there are regular times, at these too. A
    smooth function touches its bounds at single times; formulas have regular times of their own (`with_regular`). A
    function with kinks may be on a bound along whole stretches: there, bounds are imposed wherever the margin is below
    0.9 of the back-off that programs demand. A coarse exchange examines a fifth of the regular times, and leaves out
    small violations.
    """
    if is_smooth(problem) or not is_linear(problem):
        return [_CLOSE for _ in problem.constraints], []
    samples, constraints = problem.samples[0].times, problem.constraints
    below = [-ALMOST / 2 if is_coarse else _HELD * each.backoff for each in constraints]
    return below, _regular_times(samples, constraints, _FEW_BETWEEN if is_coarse else _BETWEEN)


def _regular_times(samples: Array, constraints: Sequence[Constraint], count: int) -> list[Array]:
    """Return, for each constraint, regular times [s] of its index set, about so many between two `samples` [s].

    They are whole steps of the plant from the first sample. If every step is regular, active bounds at neighbouring
    steps have kernels in common, whose weights cancel (see `at_steps`).
    """
    found, between = [], float(np.median(np.diff(samples))) if len(samples) > 1 else 0.0
    for constraint in constraints:
        step = constraint.quantity.sampling_time
        apart = step * max(1.0, np.rint(between / (count * step)))
        first, last = (np.array(constraint.index_set.ends) - samples[0]) / apart
        times = samples[0] + apart * np.arange(np.ceil(first), np.floor(last) + 1)
        found.append(np.unique(constraint.index_set.nearest(times)))
    return found


def _removed_by_backoff(problem: ConstrainedProblem, bent: ConstrainedMean, is_rough: bool) -> float:
    """Return the violation, as a part of a width, that need not be removed: a back-off leaves room for it.

    If many bounds are active, they are later tightened by the largest back-off that raises the objective J by no more
    than `gap_allowed`: for functions with kinks because the proof is then short, for smooth functions because of the
    violations that are left. Rounds that remove only violations which this back-off removes anyway would be wasted. If
    no larger back-off follows, functions with kinks may use a part of the present one. The result is 0 if few bounds
    are active.
    """
    if np.count_nonzero(bent.multipliers) <= MANY_CONTACTS:
        return 0.0
    enough, present = gap_allowed(bent.price) / bent.rise, 2 * min(each.backoff for each in problem.constraints)
    return _OF_BACKOFF * (enough if enough > _FAR * present else present * is_rough)


def at_steps(problem: ConstrainedProblem, places: Places, known: Places, same: float) -> Places:
    """Return `places` (times and sides), moved by up to half a step to whole steps from the first sample.

    This is done for functions with kinks only: functions with analytic kernels touch a bound at single times.

    An active bound of g(t + T_s) − g(t) adds kernels at t and at t + T_s, with weights of opposite sign. Neighbouring
    bounds at whole steps have such times in common, and their weights there cancel in the sum. At other times, kernels
    with large weights and different centres cancel only after evaluation, with rounding errors that can be a thousand
    times larger. A place is not moved to within `same` [s] of a known place, nor out of its index set.
    """
    if is_smooth(problem):
        return places
    origin, constraints = float(problem.samples[0].times[0]), problem.constraints
    return tuple(_at_steps(*of_one, origin, same) for of_one in zip(constraints, places, known, strict=True))


def _at_steps(constraint: Constraint, places: Array, known: Array, origin: float, same: float) -> Array:
    steps = [functional.sampling_time for _, functional in constraint.quantity.arguments]
    if not steps:
        return places
    step, moved = steps[0], places.copy()
    moved[:, 0] = constraint.index_set.nearest(origin + step * np.rint((places[:, 0] - origin) / step))
    first, last = constraint.index_set.ends
    stay = near_to(known, moved, same) | (moved[:, 0] < first) | (moved[:, 0] > last)
    moved[stay] = places[stay]
    return moved


def is_smooth(problem: ConstrainedProblem) -> bool:
    """Whether all kernels are analytic: then a function touches its bounds at single times."""
    return all(part.kernel.is_analytic for part in problem.prior.parts)


def same_time(signals: tuple[KernelSum, ...], violation: float = 0.0) -> float:
    """Return the distance [s] below which two times of bounds count as equal: 3e-4 of the least correlation time.

    If a `violation` v (a part of a width) is allowed between two times, it is √v of the correlation time: a smooth
    function that touches its bound at two times h apart violates it between them by about h² in these units.
    """
    return max(_SAME_TIME, math.sqrt(violation)) * min(signal.kernel.correlation_time for signal in signals)


def no_places(problem: ConstrainedProblem) -> Places:
    """Return, for each constraint, an empty array (0, 2) of places (times and sides)."""
    return tuple(np.empty((0, 2)) for _ in problem.constraints)
