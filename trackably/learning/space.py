"""The box in which hyperparameters are searched, and the points from which searches start."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from trackably.arguments import whole
from trackably.arrays import Array
from trackably.gp.hyperparameter import Learned, Scales, Search
from trackably.gp.joint import JointPrior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencil
from trackably.systems.intervals import Interval

MOST_STARTS = 10_000
"""Largest number of starts: more would take days, and more memory than there is."""


@dataclass(frozen=True)
class SearchSpace:
    """A box of learned hyperparameters, with positive `bounds`, and the number of `starts` spread over it.

    Starts lie in the interval `sought` of a hyperparameter if it has one, otherwise in the middle half of ln(bounds).
    """

    bounds: dict[str, Interval]
    starts: int = 8
    sought: dict[str, Interval] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "starts", whole("search: starts", self.starts, least=1, most=MOST_STARTS))

    @classmethod
    def around(
        cls,
        samples: tuple[Samples, ...],
        prior: JointPrior,
        starts: int = 8,
        shortest: float = 0.0,
    ) -> Self:
        """Return the search intervals of the prior's learned hyperparameters, as given or chosen from the samples.

        Chosen intervals scale with the samples: amplitudes with the root mean square of y − m, times with the span and
        the smallest spacing. Chosen length scales are no shorter than `shortest` [s]. The interval of a shared
        hyperparameter is that of the first process.
        """
        found = dict[str, Search]()
        for (process, part), of in zip(prior.named_parts.items(), samples, strict=True):
            scales = _scales(of, part, shortest)
            for name, value in part.hyperparameters.items():
                if isinstance(value, Learned):
                    found.setdefault(prior.name_of(process, name), value.search(scales))
        return cls(
            {name: Interval(*search.bounds) for name, search in found.items()},
            starts,
            {name: Interval(*search.starts) for name, search in found.items() if search.starts},
        )

    @property
    def log_lower(self) -> Array:
        return np.log([interval.lower for interval in self.bounds.values()])

    @property
    def log_upper(self) -> Array:
        return np.log([interval.upper for interval in self.bounds.values()])

    def start_points(self) -> Array:
        """Return ln θ of the starts, shape (starts, p); (1, 0) if p = 0.

        They are spread evenly over their intervals by an additive recurrence.
        """
        low, high = self.log_lower, self.log_upper
        first, last = (3 * low + high) / 4, (low + 3 * high) / 4
        for i, name in enumerate(self.bounds):
            if sought := self.sought.get(name):
                first[i], last[i] = np.log([sought.lower, sought.upper])
        return np.asarray(first + (last - first) * self._spread(self.starts))

    def points(self, count: int) -> Array:
        """Return ln θ of `count` points, shape (count, p); (1, 0) if p = 0.

        They are spread evenly over the box by an additive recurrence.
        """
        return np.asarray(self.log_lower + (self.log_upper - self.log_lower) * self._spread(count))

    def _spread(self, count: int) -> Array:
        # Steps of the recurrence in p dimensions: x⁻¹, …, x⁻ᵖ for the root of x^(p+1) = x + 1 (golden ratio for p = 1).
        p = len(self.bounds)
        count = count if p else 1
        root = 2.0
        for _ in range(60):
            root = (1 + root) ** (1 / (p + 1))
        return np.asarray(np.outer(np.arange(1, count + 1), root ** -np.arange(1.0, p + 1)) % 1)

    def scaled_down(self, log_theta: Array, by: float) -> Array:
        """Return ln θ with every signal_std divided by `by`, but not below the lower bounds."""
        amplitude = np.array([name.endswith("signal_std") for name in self.bounds])
        return np.asarray(np.maximum(log_theta - np.log(by) * amplitude, self.log_lower))


def amplitude(samples: Samples, prior: Prior) -> float:
    """Return the amplitude of a signal, estimated by the root mean square of y − m; by σ_n if y = m everywhere.

    The unit is that of the process. ValueError: the squares overflow.
    """
    samples = samples.of_level
    stencil = samples.stencil
    with np.errstate(over="ignore"):
        size = float(np.sqrt(np.mean((samples.values - stencil.at_rest(prior.mean)) ** 2))) or prior.noise_std
    if not size < np.inf:
        largest = float(np.max(np.abs(samples.values)))
        raise ValueError(f"samples: values are too large to be squared, up to {largest:g}; choose another unit")
    return size / abs(sum(stencil.weights)) if isinstance(stencil, Stencil) and stencil.measures_levels else size


def _scales(samples: Samples, prior: Prior, shortest: float) -> Scales:
    span = float(samples.times[-1] - samples.times[0]) or 1.0
    spacing = float(np.min(np.diff(np.unique(samples.times)), initial=span))
    return Scales(amplitude(samples, prior), span, spacing, len(samples), shortest)
