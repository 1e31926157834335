"""Where hyperparameters are looked for, and from where the search starts."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from pipeline.arrays import Array
from pipeline.gp.prior import NOISE, Prior
from pipeline.gp.samples import Samples
from pipeline.systems.interval import Interval

# Bounds relative to the samples' own scales: wide enough to hold every sensible answer, narrow enough that
# K + σ_n² I can still be factored at nearly every point.
_SPREAD = {"signal_std": (1e-3, 1e3), "noise_std": (1e-4, 1e1), "shape": (1e-2, 1e4), "period": (0.1, 4.0)}
_RELATIVE_LENGTHSCALE = (0.05, 20.0)


@dataclass(frozen=True)
class SearchSpace:
    """A box of learned hyperparameters (natural units, positive bounds), and the number of `starts` spread over it."""

    bounds: dict[str, Interval]
    starts: int = 8

    def __post_init__(self) -> None:
        for name, interval in self.bounds.items():
            if interval.lower <= 0:
                raise ValueError(f"search: the lower bound of {name} must be positive, got {interval.lower:g}")
        if self.starts < 1:
            raise ValueError(f"search: starts must be at least 1, got {self.starts}")

    @classmethod
    def around(cls, samples: Samples, prior: Prior, bounds: dict[str, Interval] | None = None, starts: int = 8) -> Self:
        """Bounds from the scales of the samples for every learned hyperparameter that `bounds` does not name.

        Amplitudes are measured by the root mean square of y − m, times by the samples' span and smallest spacing.
        """
        return cls({name: (bounds or {}).get(name) or _default(name, samples, prior) for name in prior.learned}, starts)

    @property
    def log_lower(self) -> Array:
        return np.log([interval.lower for interval in self.bounds.values()])

    @property
    def log_upper(self) -> Array:
        return np.log([interval.upper for interval in self.bounds.values()])

    def start_points(self) -> Array:
        """ln θ of the starts, shape (starts, p): an additive recurrence in the middle half of the box."""
        # The most irrational steps in p dimensions: powers of the root of x^(p+1) = x + 1 (the golden ratio for p = 1).
        p = len(self.bounds)
        root = 2.0
        for _ in range(60):
            root = (1 + root) ** (1 / (p + 1))
        unit = np.outer(np.arange(1, self.starts + 1), root ** -np.arange(1.0, p + 1)) % 1
        return np.asarray(self.log_lower + (0.25 + 0.5 * unit) * (self.log_upper - self.log_lower))

    def faded(self, log_theta: Array, by: float) -> Array:
        """The point with every signal_std divided by `by`, as far as the box allows."""
        amplitude = np.array([name.endswith("signal_std") for name in self.bounds])
        return np.asarray(np.maximum(log_theta - np.log(by) * amplitude, self.log_lower))


def _default(name: str, samples: Samples, prior: Prior) -> Interval:
    amplitude = float(np.sqrt(np.mean((samples.values - prior.mean) ** 2))) or prior.noise_std
    span = float(samples.times[-1] - samples.times[0]) or 1.0
    spacing = float(np.min(np.diff(samples.times), initial=span))
    kind = name.rsplit(".", 1)[-1]
    if kind == "lengthscale" and name.replace("lengthscale", "period") in prior.hyperparameters:
        return Interval(*_RELATIVE_LENGTHSCALE)  # of a periodic kernel: measured in its period
    if kind == "lengthscale":
        return Interval(spacing / 10, 100 * span)
    scale = {"signal_std": amplitude, NOISE: amplitude, "period": span}.get(kind, 1.0)
    low, high = _SPREAD[kind]
    return Interval(low * scale, high * scale)
