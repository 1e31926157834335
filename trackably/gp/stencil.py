"""Stencils: how samples depend on the process. A sample is a weighted sum of its values at shifted times."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.gp.kernels.base import Kernel

_CANCELLED = 1e-9  # relative to the largest weight: smaller sums of weights count as 0, and the stencil as a difference


Covariance = Callable[[Array], tuple[Array, Array]]
"""Returns k(r) of two samples r [s] apart, and ∂k/∂ln θ_j; shapes (*r.shape) and (p, *r.shape). k is even in r."""


class _Instants:
    """What Stencil and Stencils share: y(t) = offset + Σ_j w_j g(t + j `step`), with `weights` w and step in seconds.

    Weights and offset are numbers, or arrays (n,) for n samples.
    """

    def measured(self: Any, process: Callable[[Array], Array], t: Array) -> Array:
        """Return the values y(t) that are measured of a process g at times t [s]; an array of the same shape as t."""
        return np.asarray(self.offset + sum(w * process(t + j * self.step) for j, w in enumerate(self.weights)))

    def at_rest(self: Any, level: float) -> Any:
        """Return the measured value of a process that is constant at `level`: a number, or numbers (n,)."""
        return self.offset + sum(self.weights) * level

    def centres(self: Any, t: Array) -> Array:
        """Return the instants t + j step [s] on which samples at t, shape (n,), depend; the shape is (n · J,)."""
        return np.concatenate([t + j * self.step for j in range(len(self.weights))])

    def spread(self: Any, values: Array) -> Array:
        """Return values (…, n) at the samples as weighted values at the centres; the shape is (…, n · J).

        This is the transpose of the linear map from process to samples.
        """
        return np.concatenate([w * values for w in self.weights], axis=-1)

    def combine(self: Any, values: Array) -> Array:
        """Return the weighted sum, for each sample, of values (…, n · J) at its centres; the shape is (…, n)."""
        parts = np.split(values, len(self.weights), axis=-1)
        return np.asarray(sum(w * part for w, part in zip(self.weights, parts, strict=True)))

    @property
    def length(self: Any) -> float:
        """The time [s] from the first instant of a sample to the last one."""
        return float((len(self.weights) - 1) * self.step)

    def covariance_at(self: Any, kernel: Kernel, apart: Array) -> tuple[Array, Array]:
        """Return the covariance (n, n) of samples whose times are `apart` [s], t_i − t_j, and ∂/∂ln θ: (p, n, n).

        An entry is Σ_d ρ_d κ(t − t' + d step) with ρ_d = Σ_j w_j w'_(j − d).
        """
        w, count = self.weights, len(self.weights)
        lags = ((d, range(max(d, 0), min(count, count + d))) for d in range(1 - count, count))
        pairs = ((sum(np.multiply.outer(w[j], w[j - d]) for j in of), apart + d * self.step) for d, of in lags)
        parts = ([rho * each for each in kernel.value_and_gradient(r)] for rho, r in pairs)
        value, gradient = next(parts)
        for of_value, of_gradient in parts:
            value += of_value
            gradient += of_gradient
        return value, gradient


@dataclass(frozen=True)
class Stencil(_Instants):
    """The measured signal y(t) = offset + Σ_j w_j g(t + j `step`) of a process g, with `weights` w and step in seconds.

    ValueError: all weights are zero.
    """

    weights: tuple[float, ...]
    step: float = 0.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        if not any(self.weights):
            raise ValueError("stencil: samples must depend on the process, but all weights are zero")

    def only(self, _: object) -> "Stencil":
        """Return the stencil of some of the samples: this stencil, as all samples have the same one."""
        return self

    @property
    def measures_levels(self) -> bool:
        """Whether the samples of a process at rest depend on its level, by more than rounding."""
        return abs(sum(self.weights)) > _CANCELLED * max(map(abs, self.weights))


POINT = Stencil((1.0,))
"""Samples of the process itself."""


# Several stencils of one process: its samples are measurements of several kinds, such as positions and velocities.


@dataclass(frozen=True)
class Stencils(_Instants):
    """Samples of several kinds of one process g: sample i is measured by `parts`[`of`[i]], called `names`[`of`[i]].

    ValueError: parts have different steps, or one of them measures no sample.
    """

    parts: tuple[Stencil, ...]
    names: tuple[str, ...]
    of: tuple[int, ...]

    def __post_init__(self) -> None:
        if len({part.step for part in self.parts if len(part.weights) > 1}) > 1:
            raise ValueError(
                f"stencils: steps must be the same, got {', '.join(str(part.step) for part in self.parts)} s"
            )
        if len(self.parts) != len(self.names) or not {*self.of} == {*range(len(self.parts))}:
            raise ValueError(
                f"stencils: expected a part for each of {', '.join(self.names)}, with at least one sample, got "
                f"{len(self.parts)} parts"
            )

    @cached_property
    def step(self) -> float:
        """The time [s] between the instants of a sample."""
        return max(part.step for part in self.parts)

    @cached_property
    def places(self) -> npt.NDArray[np.intp]:
        """The index of the stencil, among `parts`, that measures each sample; the shape is (n,)."""
        return np.array(self.of)

    @cached_property
    def weights(self) -> Array:
        """The weights w_0, w_1, … of each sample; the shape is (J, n)."""
        longest = max(len(part.weights) for part in self.parts)
        padded = [[*part.weights, *[0.0] * (longest - len(part.weights))] for part in self.parts]
        return np.asarray(np.array(padded).T[:, self.places])

    @cached_property
    def offset(self) -> Array:
        """The constant of each sample, shape (n,)."""
        return np.array([part.offset for part in self.parts])[self.places]

    def only(self, chosen: npt.NDArray[np.intp]) -> "Stencil | Stencils":
        """Return the stencils of some samples; a single stencil if these are of one kind."""
        of: list[int] = self.places[chosen].tolist()
        kept = sorted(set(of))
        if len(kept) == 1:
            return self.parts[kept[0]]
        parts, names = tuple(self.parts[i] for i in kept), tuple(self.names[i] for i in kept)
        return Stencils(parts, names, tuple(kept.index(i) for i in of))
