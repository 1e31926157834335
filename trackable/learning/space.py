"""Where hyperparameters are looked for, and from where the search starts."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from trackable.arrays import Array
from trackable.gp.joint import JointPrior
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples
from trackable.systems.sets.interval import Interval

# Where a hyperparameter may lie, and where it is sought first, relative to the samples' own scales. Wide enough to hold
# every sensible answer; an amplitude may have to fade by orders of magnitude before a reference is feasible.
_SPREAD = {
    "signal_std": ((1e-12, 1e3), (0.1, 10.0)),
    "noise_std": ((1e-4, 1e1), (1e-2, 1.0)),
    "shape": ((1e-2, 1e4), (0.3, 30.0)),
}
_RELATIVE_LENGTHSCALE = (0.1, 10.0)
# Weights of a difference add up to zero, but for rounding.
_CANCELLED = 1e-9


@dataclass(frozen=True)
class SearchSpace:
    """A box of learned hyperparameters (natural units, positive `bounds`), and the number of `starts` spread over it.

    Starts lie where `sought` says, and in the middle half of the bounds (of their logarithms) of all others.
    """

    bounds: dict[str, Interval]
    starts: int = 8
    sought: dict[str, Interval] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, interval in self.bounds.items():
            if interval.lower <= 0:
                raise ValueError(f"search: the lower bound of {name} must be positive, got {interval.lower:g}")
        if self.starts < 1:
            raise ValueError(f"search: starts must be at least 1, got {self.starts}")

    @classmethod
    def around(
        cls,
        samples: tuple[Samples, ...],
        prior: JointPrior,
        bounds: dict[str, Interval] | None = None,
        starts: int = 8,
    ) -> Self:
        """Bounds from the scales of the samples for every learned hyperparameter that `bounds` does not name.

        Amplitudes are measured by the root mean square of y − m, times by the samples' span and smallest spacing.
        """
        given = bounds or {}
        if unknown := given.keys() - set(prior.learned):
            raise ValueError(f"search: bounds are given for {', '.join(sorted(unknown))}, which is not learned")
        chosen = {name: _default(name, samples, prior) for name in prior.learned if name not in given}
        return cls(
            {name: given[name] if name in given else chosen[name][0] for name in prior.learned},
            starts,
            {name: start for name, (_, start) in chosen.items() if start is not None},
        )

    @property
    def log_lower(self) -> Array:
        return np.log([interval.lower for interval in self.bounds.values()])

    @property
    def log_upper(self) -> Array:
        return np.log([interval.upper for interval in self.bounds.values()])

    def start_points(self) -> Array:
        """ln θ of the starts, shape (starts, p): an additive recurrence in where each is sought."""
        low, high = np.array([self._log_sought(name) for name in self.bounds]).reshape(-1, 2).T
        return np.asarray(low + (high - low) * self._spread(self.starts))

    def points(self, count: int) -> Array:
        """ln θ of `count` points, shape (count, p): an additive recurrence in the whole box."""
        return np.asarray(self.log_lower + (self.log_upper - self.log_lower) * self._spread(count))

    def _spread(self, count: int) -> Array:
        # The most irrational steps in p dimensions: powers of the root of x^(p+1) = x + 1 (the golden ratio for p = 1).
        p = len(self.bounds)
        root = 2.0
        for _ in range(60):
            root = (1 + root) ** (1 / (p + 1))
        return np.asarray(np.outer(np.arange(1, count + 1), root ** -np.arange(1.0, p + 1)) % 1)

    def _log_sought(self, name: str) -> tuple[float, float]:
        if name in self.sought:
            return float(np.log(self.sought[name].lower)), float(np.log(self.sought[name].upper))
        low, high = np.log([self.bounds[name].lower, self.bounds[name].upper]).tolist()
        return (3 * low + high) / 4, (low + 3 * high) / 4

    def faded(self, log_theta: Array, by: float) -> Array:
        """The point with every signal_std divided by `by`, as far as the box allows."""
        amplitude = np.array([name.endswith("signal_std") for name in self.bounds])
        return np.asarray(np.maximum(log_theta - np.log(by) * amplitude, self.log_lower))


def amplitude(samples: Samples, prior: Prior) -> float:
    """Root mean square of y − m, in the unit of the process; the noise's where the samples show none."""
    stencil = samples.stencil
    seen = float(np.sqrt(np.mean((samples.values - stencil.at_rest(prior.mean)) ** 2))) or prior.noise_std
    gain = abs(sum(stencil.weights))
    sees_levels = gain > _CANCELLED * max(map(abs, stencil.weights))
    return seen / gain if sees_levels else seen


def _default(name: str, samples: tuple[Samples, ...], prior: JointPrior) -> tuple[Interval, Interval | None]:
    """Bounds, and where to start within them if that is not their middle half: of the first process with that name."""
    place = prior.learned.index(name)
    process = next(i for i, places in enumerate(prior.places) if place in places)
    own = prior.parts[process].learned[prior.places[process].index(place)]
    return _of_process(own, samples[process], prior.parts[process])


def _of_process(name: str, samples: Samples, prior: Prior) -> tuple[Interval, Interval | None]:
    span = float(samples.times[-1] - samples.times[0]) or 1.0
    spacing = float(np.min(np.diff(samples.times), initial=span))
    kind = name.rsplit(".", 1)[-1]
    if kind == "lengthscale" and name.replace("lengthscale", "period") in prior.hyperparameters:
        return Interval(*_RELATIVE_LENGTHSCALE), None  # of a periodic kernel: measured in its period
    if kind == "lengthscale":
        return Interval(spacing / 10, 100 * span), None
    if kind == "period":  # seen once at least, and three samples each time: with two it may be an alias
        whole = Interval(span * min(0.5, 3 / max(len(samples) - 1, 1)), span)
        return whole, whole  # local minima lie everywhere in it
    scale = 1.0 if kind == "shape" else amplitude(samples, prior)
    (low, high), (first, last) = _SPREAD[kind]
    return Interval(low * scale, high * scale), Interval(first * scale, last * scale)
