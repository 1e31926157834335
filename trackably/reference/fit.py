"""A reference with its learning results: its distance from its samples, and the cost of its bounds.

A misfit is the distance from the samples of one name, and is compared with that of the fit without bounds. A contact is
a bound that is active for some time: active bounds at neighbouring times are joined. An edge is a hyperparameter at an
end of its search interval.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.prior import NOISE
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum
from trackably.learning.joint.places import places_of
from trackably.learning.problem import ActiveBound, Method, Side, Solution
from trackably.learning.space import SearchSpace
from trackably.reference.condensed import Condensation
from trackably.reference.waypoints import Waypoint
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference


@dataclass(frozen=True)
class Contact:
    """A bound or given value of the quantity `name`, active from `start` to `end` [s]; it costs `price` in −2 ln p."""

    name: str
    side: Side
    start: float
    end: float
    price: float

    def __str__(self) -> str:
        bound = "the given value of " + self.name if self.side == "equal" else f"the {self.name} {self.side} bound"
        start, end = _seconds(self.start), _seconds(self.end)
        when = f"at {start} s" if start == end else f"between {start} and {end} s"
        return f"{bound} costs {self.price:.3g} {when}"


def _seconds(time: float) -> str:
    """Format a time [s] with at least three digits, and to a hundredth of a second."""
    return f"{time:.3g}" if abs(time) < 10 else f"{round(time, 2):.12g}"


# A reference ignores its samples if its residuals exceed all three limits: see `Misfit.is_large`.
_TIMES_UNCONSTRAINED = 3.0
_TIMES_NOISE = 1.0
_OF_SPREAD = 0.1


@dataclass(frozen=True, eq=False)
class Misfit:
    """The residuals of the samples called `name`: samples minus reference, and minus the fit without bounds.

    They are `off` and `unconstrained`, both of shape (n,). `noise_std` is σ_n of the reference, and
    `noise_unconstrained` that of the fit without bounds; `is_learned` tells whether the latter was learned from the
    samples. If the samples are centres that represent more samples, root mean squares are over all represented samples,
    weighted by the inverse of their relative variances.
    """

    name: str
    samples: Samples
    off: Array
    unconstrained: Array
    noise_std: float
    noise_unconstrained: float
    is_learned: bool

    @property
    def size(self) -> float:
        """The root mean square of samples minus reference, in the unit of the samples."""
        return self._size(self.off)

    @property
    def size_unconstrained(self) -> float:
        """The root mean square of samples minus the fit without bounds, in the unit of the samples."""
        return self._size(self.unconstrained)

    @property
    def in_noise(self) -> float:
        """The root mean square of samples minus reference, each divided by the standard deviation of its noise."""
        return self._weigh(self.off) / self.noise_std

    @property
    def is_large(self) -> bool:
        """Whether the reference ignores the samples.

        The root mean square of the residuals, weighted by relative noise, has to exceed three limits. The first is 3
        times its value for the fit without bounds: larger residuals are explained neither by the kernel nor by noise.
        The second is σ_n of the fit without bounds, because a fit through all samples has residuals near zero. The
        third is a tenth of the samples' spread, because smaller residuals are hardly visible in a plot.
        """
        w = self.samples.relative_noise**-2
        about = self.samples.values - np.average(self.samples.values, weights=w)
        return self._weigh(self.off) > max(
            _TIMES_UNCONSTRAINED * self._weigh(self.unconstrained),
            _TIMES_NOISE * self.noise_unconstrained,
            _OF_SPREAD * self._weigh(about),
        )

    def _size(self, values: Array) -> float:
        return math.sqrt(self.samples.mean_square(values))

    def _weigh(self, values: Array) -> float:
        scatter = self.samples.scatter
        squares = float(np.sum((values / self.samples.relative_noise) ** 2)) + scatter.squares
        return float(np.sqrt(squares / (len(values) + scatter.count)))


_AT_EDGE = 1e-4  # in ln θ: a value closer than this to an end of its interval counts as being at this end


@dataclass(frozen=True)
class Edge:
    """A learned hyperparameter at an end of its search `interval`; `is_given` if the user chose the interval."""

    name: str
    value: float
    interval: Interval
    is_given: bool

    @classmethod
    def of(cls, name: str, value: float, interval: Interval) -> Self | None:
        """Return the edge if `value` lies at an end of the interval; None if it lies inside."""
        inside = np.log([value / interval.lower, interval.upper / value]) > _AT_EDGE
        given = isinstance(value, Learned) and value.interval is not None
        return None if inside.all() else cls(name, float(value), interval, given)

    def __str__(self) -> str:
        end = "lower" if self.value < math.sqrt(self.interval.lower) * math.sqrt(self.interval.upper) else "upper"
        return f"{self.name} = {self.value:.4g} lies at the {end} end of the interval in which it was sought"


def narrow_limits(edges: Iterable[Edge]) -> list[str]:
    """Return a warning's text for each hyperparameter that lies at an end of an interval that the user gave."""
    return [
        f"{edge}, {edge.interval}: widen it, unless this end is meant as a limit" for edge in edges if edge.is_given
    ]


def edges_of(prior: JointPrior, samples: tuple[Samples, ...]) -> tuple[Edge, ...]:
    """Return the hyperparameters, learned from these samples, that lie at an end of their search interval."""
    space, learned = SearchSpace.around(samples, prior), prior.hyperparameters
    found = (Edge.of(name, learned[name], interval) for name, interval in space.bounds.items())
    return tuple(edge for edge in found if edge)


def residual(samples: Samples, signal: KernelSum) -> Array:
    """Return the samples of one kind, minus the values that a signal has at their times: shape (n,)."""
    return samples.values - samples.stencil.measured(signal, samples.times)


@dataclass(frozen=True, eq=False)
class Fit:
    """The learning results of a `reference` learned from `samples` of the flat outputs, without its proof.

    `prior` has the learned hyperparameters, `unconstrained_prior` those of the least l found without bounds.
    `objective` is J = l + D; `method` says whether the function was learned, or its hyperparameters alone (then D = 0).
    `active_bounds` are the bounds that the reference touches, with multipliers and prices. `pinned` are the required
    values of states or inputs at given times. `condensed` is the effect of replacing samples by fewer ones. `limited`
    names the length scales that were searched only as far as float64 can evaluate the reference. `budget` [s] is the
    time limit that ended the search, or None. `spread` is the range of J among functions from several starts. `free`
    are the names whose prior mean was learned. The search tightened some bounds by up to `backoff` times their width,
    and so examined no functions closer to these bounds; it is 0 if all bounded quantities are linear in the signals.
    """

    reference: Reference
    samples: tuple[Samples, ...]
    prior: JointPrior
    unconstrained_prior: JointPrior
    objective: float
    moved: Method  # the `method`, under the name that it has in files
    active_bounds: tuple[ActiveBound, ...]
    pinned: tuple[Waypoint, ...]
    condensed: tuple[Condensation, ...] = ()
    limited: tuple[str, ...] = ()
    budget: float | None = None
    spread: float = 0.0
    free: tuple[str, ...] = ()
    backoff: float = 0.0

    def __post_init__(self) -> None:
        known = [quantity.name for quantity in self.reference.quantities]
        for i, bound in enumerate(self.active_bounds):
            if bound.side != "equal" and bound.name not in known:
                raise ValueError(f"active_bounds[{i}].name: expected one of {', '.join(known)}, got {bound.name!r}")

    @classmethod
    def of(
        cls,
        reference: Reference,
        solution: Solution,
        unconstrained: JointPosterior,
        pinned: tuple[Waypoint, ...],
    ) -> Self:
        """Return the fit of a solution.

        The solution is compared with the posterior without bounds, `unconstrained`, or with the solution's own
        posterior if l is smaller for its hyperparameters.
        """
        learned, sought = solution.posterior, unconstrained.prior.learned
        least = min(unconstrained, learned, key=lambda posterior: posterior.negative_log_marginal_likelihood()[0])

        def mark(name: str, value: float) -> float:
            """Return the value, as `Learned` if it was learned without bounds, even if it was then taken as known."""
            return Learned(value) if name in sought and not isinstance(value, Learned) else value

        return cls(
            reference,
            learned.samples,
            learned.prior,
            least.prior.map_values(mark),
            solution.objective,
            solution.method,
            solution.active_bounds,
            pinned,
            spread=solution.spread,
            backoff=solution.backoff,
        )

    @property
    def method(self) -> Method:
        """What was learned: the function with its hyperparameters, or the hyperparameters alone."""
        return self.moved

    @cached_property
    def posterior(self) -> JointPosterior:
        return JointPosterior(self.prior, self.samples)

    @cached_property
    def unconstrained_posterior(self) -> JointPosterior:
        return JointPosterior(self.unconstrained_prior, self.samples)

    @cached_property
    def price(self) -> float:
        """The cost of the bounds: the objective J minus the least l = −2 ln p found without bounds."""
        return self.objective - self.unconstrained_posterior.negative_log_marginal_likelihood()[0]

    @cached_property
    def solution(self) -> Solution:
        """The result as a `Solution`, from which the search for a similar problem can start."""
        places = places_of(self.active_bounds, [quantity.name for quantity in self.reference.quantities])
        found = self.posterior, self.reference.kernel_sums, self.objective, places, 0
        return Solution(*found, active_bounds=self.active_bounds, method=self.method)

    @property
    def duality_gap(self) -> float:
        """An upper bound of a further decrease of J for the same hyperparameters: 2 Σ_a λ_a s_a ≥ 0.

        λ_a is the multiplier of the active bound a, and s_a is the slack of the reference at this bound. The bounds are
        those of the plant, not those tightened for the proof. For linear systems, weak duality proves the bound; for
        nonlinear ones it holds to first order. Given values do not contribute, because they are met exactly.
        """
        return sum(
            2 * bound.multiplier * self._distance(bound) for bound in self.active_bounds if bound.side != "equal"
        )

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The active bounds, joined if they are less than a correlation time apart; the most expensive come first.

        Only bounds of the same quantity and side are joined, and no given values. Those that cost nothing are left out.
        """
        apart = min(signal.kernel.correlation_time for signal in self.reference.kernel_sums)
        found: list[Contact] = []
        for bound in sorted(self.active_bounds, key=lambda bound: (bound.name, bound.side, bound.time)):
            last = found[-1] if found and bound.side != "equal" else None
            if last and (last.name, last.side) == (bound.name, bound.side) and bound.time - last.end < apart:
                found[-1] = replace(last, end=bound.time, price=last.price + bound.price)
            else:
                found.append(Contact(bound.name, bound.side, bound.time, bound.time, bound.price))
        return tuple(sorted((of for of in found if of.price > 0), key=lambda contact: -contact.price))

    @cached_property
    def misfits(self) -> tuple[Misfit, ...]:
        """The residuals of the reference and of the fit without bounds, for the samples of each name."""
        signals = self.samples, self.reference.kernel_sums, self.unconstrained.kernel_sums
        every = zip(self.prior.names, self.prior.parts, self.unconstrained_prior.parts, *signals, strict=True)
        return tuple(
            Misfit(
                *(name, of, residual(of, signal), residual(of, free)),
                *(float(own.noise_std), float(least.noise_std), NOISE in least.learned),
            )
            for process, own, least, together, signal, free in every
            for name, of in together.by_name(process).items()
        )

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """The learned hyperparameters that lie at an end of their search interval."""
        return edges_of(self.prior, self.samples)

    @cached_property
    def unconstrained(self) -> Reference:
        """The posterior mean with the least l = −2 ln p(samples) found, as a reference; it may violate any bound."""
        return Reference(self.unconstrained_posterior.signals, self.reference.plant)

    def _distance(self, bound: ActiveBound) -> float:
        """Return the slack of the reference at an active bound, in the quantity's unit."""
        quantity = self.reference.quantity(bound.name)
        value = quantity(self.reference.kernel_sums, np.asarray(bound.time)).item()
        bounds = quantity.bounds.at(bound.time)
        return value - bounds.lower if bound.side == "lower" else bounds.upper - value
