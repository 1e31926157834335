"""Constraints of the learning problem: a quantity, its bounds, and the places (times) at which they have to hold.

A linear functional is a weighted sum of values of the signals at some times. For each place it gives one row: the
weights, and the times at which the signals are evaluated. All rows are evaluated together, with gradients. A formula
is a nonlinear function of functionals, which are its arguments. Each bound is tightened by its back-off, to leave room
for a proof.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.rows import Rows, Terms
from trackably.gp.signal import KernelSum
from trackably.learning.index_set import IndexSet, RealTimes, TimesAndMargins, lowest_of_each
from trackably.systems.trajectories import Functional, Quantities, Quantity, Trajectory
from trackably.work import done


def rows_of(functionals: Sequence[tuple[Functional, Array]], processes: int) -> Rows:
    """Return rows, which are weighted sums of the signals at certain times, for functionals at given times.

    There is one row for each functional at each of its times (n,) [s], functional by functional. `processes` is the
    number of signals.
    """
    terms: list[list[Terms]] = [[] for _ in range(processes)]
    offsets, count = [np.empty(0)], 0
    for functional, places in functionals:
        rows = np.arange(count, count := count + len(places))
        offsets.append(np.full(len(places), float(functional.offset)))
        for c, weights in functional.rounded:
            shifts = np.flatnonzero(weights)
            instants = places + functional.sampling_time * shifts[:, None]
            terms[c].append(Terms(instants.ravel(), weights[shifts].repeat(len(places)), np.tile(rows, len(shifts))))
    return Rows(np.concatenate(offsets), tuple(map(Terms.joined, terms)))


def values_and_gradients(rows: Rows, posterior: JointPosterior) -> Array:
    """Return the values of n `rows` (weighted sums of signals) for the posterior means, and below their ∂/∂ln θ_j.

    The result has shape (1 + p, n) for p learned hyperparameters θ_j.
    """
    found = np.zeros((len(rows), 1 + len(posterior.prior.learned)))
    found[:, 0] = rows.offsets
    for c, terms in enumerate(rows.terms):
        if len(terms.times):
            found += terms.summed(posterior.jets(c, terms.times, 0)[:, 0].T, len(rows))
    return found.T


# Bounds are usually tightened by this part of their width, which is more than the optimiser's rounding errors.
ROUNDING_BACKOFF = 1e-9
_PARTS = 8  # an interval between two neighbouring times is searched in this number of equal parts
_INNER = (np.arange(1, _PARTS) / _PARTS)[:, None]  # the inner ends of the equal parts, as fractions of the interval
# Number of further searches for a negative margin between two kinks of a signal, each in a quarter of the interval
# before: the margin may be negative in only a hundredth of the time between two kinks.
_CLOSER = 2


class Signalled(Protocol):
    """Anything with `signals`, sums of kernels: a posterior (its means), or a function learned under bounds."""

    @property
    def signals(self) -> tuple[KernelSum, ...]: ...


@dataclass(frozen=True)
class Constraint:
    """Bounds of a quantity at all times of an index set, tightened by `backoff`, a part of their width.

    A place is one instance of the bounds: a time [s], or several times if the index set consists of these. An array of
    places has one entry or row for each place.
    """

    quantity: Quantity
    index_set: IndexSet
    backoff: float = ROUNDING_BACKOFF

    def slacks(self, found: Array, places: Array) -> Array:
        """Return the relative slacks of the tightened bounds with their p derivatives: shape (1 + p, 2 n).

        `found` (1 + p, n) has the quantity at the n `places`, and then its p derivatives. The first n columns of the
        result are for the lower bound, the others for the upper bound. A relative slack is the distance to the bound,
        divided by the width of the bounds, less the back-off.
        """
        bounds = self.quantity.bounds
        both = np.concatenate([found, -found], axis=1)
        lower, upper = bounds.ends(places)
        both[0] += np.concatenate([np.broadcast_to(of, found.shape[1]) for of in (-lower, upper)])
        both /= bounds.width
        both[0] -= self.backoff
        return both

    def kinks(self, posterior: Signalled) -> Array:
        """Return the times [s] between which `closest` may miss a violation: those of possible kinks, in order.

        A sum of kernels with kinks at their centres can change from centre to centre, however long its correlation time
        is. If a signal g has a kink at a centre c, q(t) = Σ_j w_j g(t + j T_s) has kinks at c − j T_s for each j. The
        centres of analytic kernels are not shifted, because their signals change little within T_s. The result is empty
        if all kernels are analytic, and if the index set has single times only.
        """
        signals, index_set = posterior.signals, self.index_set
        if not isinstance(index_set, RealTimes) or all(signal.kernel.is_analytic for signal in signals):
            return np.empty(0)
        found, (first, last) = [signal.centres for signal in signals], index_set.ends
        for _, functional in self.quantity.arguments:
            for c, weights in functional.rounded:
                if not signals[c].kernel.is_analytic:
                    shifts = functional.sampling_time * np.arange(len(weights))
                    found.append(np.subtract.outer(signals[c].centres, shifts).ravel())
        every = np.unique(np.concatenate(found))
        return every[(first <= every) & (every <= last)]


def of_arguments(trajectory: Trajectory, found: Array) -> Array:
    """Return the values of a quantity q and below its p derivatives ∂/∂ln θ_j at n times: shape (1 + p, n).

    The `trajectory` is q as a function of k functionals, its arguments. `found`, shape (1 + p, k n), has the values of
    the functionals at these times and below their derivatives ∂/∂ln θ_j, functional by functional.
    """
    if trajectory.functional is not None:
        return found
    names = [name for name, _ in trajectory.arguments]
    arguments = dict(zip(names, np.split(found, len(names), axis=1), strict=True))
    values = {name: both[0] for name, both in arguments.items()}
    slopes = trajectory.slopes(values)
    with np.errstate(invalid="ignore"):
        gradient = sum(slopes[name] * both[1:] for name, both in arguments.items())
    return np.concatenate([trajectory.value(values)[None], np.asarray(gradient)])


def closest(constraints: Sequence[Constraint], posterior: Signalled) -> list[TimesAndMargins]:
    """Return, for each constraint, the places (times) of local minima of its margin, and the relative margins there.

    A relative margin is the distance to the nearer bound divided by the width of the bounds: negative where a bound is
    violated, 1/2 in the middle between the bounds. Constraints with a common index set are evaluated together.
    """
    found, kernels = dict[int, TimesAndMargins](), [signal.kernel for signal in posterior.signals]
    for index_set in dict.fromkeys(constraint.index_set for constraint in constraints):
        members = [i for i, constraint in enumerate(constraints) if constraint.index_set == index_set]
        done("evaluation")
        several = Quantities(tuple(constraints[i].quantity for i in members), posterior.signals)
        for i, (at, margins) in zip(members, index_set.minima_of_each(several, kernels), strict=True):
            found[i] = at, margins / constraints[i].quantity.bounds.width
    return [found[i] for i in range(len(constraints))]


def overlooked(constraints: Sequence[Constraint], posterior: Signalled) -> list[TimesAndMargins]:
    """Return, for each constraint, violations that the grid of `closest` missed: their times, and relative margins."""
    return [
        between([each], Quantities((each.quantity,), posterior.signals), [each.kinks(posterior)], _CLOSER)[0]
        for each in constraints
    ]


def between(
    constraints: Sequence[Constraint], together: Quantities, places: Sequence[Array], closer: int = 0
) -> list[TimesAndMargins]:
    """Return, for each constraint, the times of negative margins between neighbouring `places`, and these margins.

    Between two neighbours, only the lowest relative margin is searched, and returned if it is negative. The search is
    repeated `closer` times, each time in a shorter stretch around the lowest margin found before. `places` has sorted
    times [s] for each constraint, and `together` has the constraints' quantities.
    """
    if all(len(at) < 2 for at in places):
        return [(each.index_set.none, np.empty(0)) for each in constraints]
    starts, reach = [at[:-1] for at in places], [np.diff(at) for at in places]
    found = _lowest(constraints, together, starts, reach)
    for _ in range(closer):
        reach = [2 * each / _PARTS for each in reach]
        starts = [at - each / 2 for (at, _), each in zip(found, reach, strict=True)]
        found = _lowest(constraints, together, starts, reach)
    widths = [constraint.quantity.bounds.width for constraint in constraints]
    return [(at[least < 0], least[least < 0] / width) for (at, least), width in zip(found, widths, strict=True)]


def _lowest(
    constraints: Sequence[Constraint], together: Quantities, starts: Sequence[Array], reach: Sequence[Array]
) -> list[TimesAndMargins]:
    """Return, for each constraint, the time and the value of the lowest margin in each of its stretches of time.

    Stretches begin at `starts` [s] and last for `reach` [s]. Each is divided into equal parts, and margins are
    evaluated where two parts meet.
    """
    times = [
        constraint.index_set.nearest(first + _INNER * length)
        for constraint, first, length in zip(constraints, starts, reach, strict=True)
    ]
    return [lowest_of_each(*pair) for pair in zip(times, margins_at(together, times), strict=True)]


def margins_at(together: Quantities, times: Sequence[Array]) -> list[Array]:
    """Return the margin of each of the quantities at its own `times` [s], arrays of the same shapes."""
    if all(np.array_equal(at, times[0]) for at in times[1:]):  # equal times: signals are evaluated only once
        return list(together.margins(times[0]))
    lasts = [at.shape[-1] for at in times]
    margins = together.margins_of(np.repeat(np.arange(len(times)), lasts), np.concatenate(times, axis=-1))
    return np.split(margins, np.cumsum(lasts)[:-1], axis=-1)


def joined(one: Sequence[TimesAndMargins], other: Sequence[TimesAndMargins]) -> list[TimesAndMargins]:
    """Return, for each constraint, the places (times) and margins of `one` list, followed by those of the `other`."""
    pairs = zip(one, other, strict=True)
    return [(np.concatenate([a, b]), np.concatenate([c, d])) for (a, c), (b, d) in pairs]


def worst(minima: Sequence[TimesAndMargins]) -> tuple[float, int, float]:
    """Return the smallest margin, its constraint's index, and its (first) time [s].

    Without any margin, return (∞, −1, NaN).
    """
    found = [
        (margins.min().item(), i, places[np.argmin(margins)].flat[0].item())
        for i, (places, margins) in enumerate(minima)
        if len(margins)
    ]
    return min(found, default=(np.inf, -1, np.nan))
