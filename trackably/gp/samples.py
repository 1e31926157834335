"""Noisy samples of a signal."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from trackably.arguments import array, instance
from trackably.arrays import Array, ArrayLike
from trackably.gp.factors.fourier import Ladder
from trackably.gp.kernels.base import Kernel
from trackably.gp.stencil import POINT, Stencil, Stencils

_UNIFORM = np.empty(0)
_WIDE = 10.0  # times the median spacing: a longer time without samples is a gap
_FEWEST = 10  # samples: with fewer, there is no usual spacing


@dataclass(frozen=True)
class ResidualStatistics:
    """Residuals that carry information about the noise only: `count` of them, each normal with standard deviation σ_n.

    Such residuals remain if many samples are replaced by fewer. They are divided by relative noises; `squares` is the
    sum of their squares, in the squared unit of the samples. `log_scale` is a constant in −2 ln p, where p is their
    density: Σ ln ϱ_i² of the replaced samples minus that of the new ones, with relative noises ϱ_i. ValueError: a
    number is not finite, or `count` or `squares` is negative.
    """

    count: int = 0
    squares: float = 0.0
    log_scale: float = 0.0

    def __post_init__(self) -> None:
        if self.count < 0 or not 0 <= self.squares < np.inf or not np.isfinite(self.log_scale):
            raise ValueError(
                f"scatters: expected count ≥ 0, finite squares ≥ 0 and a finite log_scale, got {self.count}, "
                f"{self.squares:g} and {self.log_scale:g}"
            )

    def __add__(self, other: ResidualStatistics) -> ResidualStatistics:
        return ResidualStatistics(
            self.count + other.count, self.squares + other.squares, self.log_scale + other.log_scale
        )

    @property
    def mean_square(self) -> float:
        """The mean square of the residuals; 0 if there are none."""
        return self.squares / max(self.count, 1)

    def negative_log_likelihood(self, noise_std: float) -> tuple[float, float]:
        """Return −2 ln p of the residuals for σ_n = `noise_std`, and its ∂/∂ln σ_n."""
        if not self.count:
            return 0.0, 0.0
        in_noise = self.squares / noise_std**2
        value = self.count * np.log(2 * np.pi * noise_std**2) + in_noise + self.log_scale
        return float(value), 2 * self.count - 2 * in_noise


@dataclass(frozen=True)
class Samples:
    """`values` y_i observed at strictly increasing `times` t_i [s], both of shape (n,).

    Sample i has noise of standard deviation σ_n · `relative_noise`_i, where `relative_noise` is 1 by default. With σ_n
    = 1 the relative noise is the standard deviation itself. `stencil` describes how samples depend on the learned
    process; with `Stencils`, samples of different kinds may share a time. If the samples replace a larger number of
    samples, `scatters` has the remaining information about the noise, for each kind.

    ValueError, which names the first wrong entry: values are not finite, times do not increase, or arrays differ in
    length. TypeError: entries are no real numbers (but dates, for example).
    """

    times: Array
    values: Array
    relative_noise: Array = field(default_factory=lambda: _UNIFORM)
    stencil: Stencil | Stencils = POINT
    scatters: tuple[ResidualStatistics, ...] = ()

    if TYPE_CHECKING:  # sequences are accepted and converted to arrays

        def __init__(
            self,
            times: ArrayLike,
            values: ArrayLike,
            relative_noise: ArrayLike = ...,
            stencil: Stencil | Stencils = ...,
            scatters: tuple[ResidualStatistics, ...] = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        if self.relative_noise is _UNIFORM:
            object.__setattr__(self, "relative_noise", np.ones(np.shape(self.times)))
        instance("samples: stencil", self.stencil, Stencil | Stencils, "a Stencil, or Stencils")
        for name in ("times", "values", "relative_noise"):
            given = array(f"samples: {name}", getattr(self, name), None, advice="; leave such samples out")
            object.__setattr__(self, name, given)
        for name in ("values", "relative_noise"):
            if self.times.shape != getattr(self, name).shape:
                what = name.replace("_", " ")
                raise ValueError(
                    f"samples: as many times as {what} are needed, got {self.times.size} and {getattr(self, name).size}"
                )
        if bad := np.flatnonzero(self.relative_noise <= 0).tolist():
            raise ValueError(f"samples: relative_noise[{bad[0]}] must be positive, got {self.relative_noise[bad[0]]:g}")
        kinds = len(self.stencil.parts) if isinstance(self.stencil, Stencils) else 1
        if self.scatters and len(self.scatters) != kinds:
            raise ValueError(
                f"samples: scatters must have one entry for each of {kinds} kinds of samples, got {len(self.scatters)}"
            )
        if isinstance(self.stencil, Stencils):
            if len(self.stencil.of) != len(self.times) or np.any(np.diff(self.times) < 0):
                raise ValueError(
                    "samples: with Stencils, times must not decrease, and stencil.of needs one entry for each sample, "
                    f"got {len(self.stencil.of)} entries for {len(self.times)} samples"
                )
            self.by_name("")  # refuses times that are repeated within one kind
        elif bad := np.flatnonzero(np.diff(self.times) <= 0).tolist():
            i = bad[0]
            what = "repeats" if self.times[i + 1] == self.times[i] else "lies before"
            raise ValueError(
                f"samples: times must increase strictly, but times[{i + 1}] = {self.times[i + 1]:g} s {what} "
                f"times[{i}] = {self.times[i]:g} s; sort samples by time, and average those of one time"
            )

    def only(self, at: npt.NDArray[np.intp]) -> Samples:
        """Return the samples with the increasing indices `at`, at least one.

        The statistics of samples that these replace (`scatters`) are left out, because they describe all samples.
        """
        return Samples(self.times[at], self.values[at], self.relative_noise[at], self.stencil.only(at))

    def by_name(self, name: str) -> dict[str, Samples]:
        """Return the samples of each kind by the name of the kind; samples of a single kind get the given `name`."""
        if not isinstance(self.stencil, Stencils):
            return {name: self}
        return {
            kind: replace(self.only(np.flatnonzero(self.stencil.places == i)), scatters=self.scatters[i : i + 1])
            for i, kind in enumerate(self.stencil.names)
        }

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """The start [s] and duration [s] of times without samples, over 10 times the median spacing, longest first.

        There are no gaps among fewer than 10 samples.
        """
        if len(self) < _FEWEST:
            return []
        spacings = np.diff(self.times)
        before = np.flatnonzero(spacings > _WIDE * np.median(spacings))
        longest = before[np.argsort(-spacings[before], kind="stable")]
        return list(zip(self.times[longest].tolist(), spacings[longest].tolist(), strict=True))

    @property
    def of_level(self) -> Samples:
        """The samples of the first kind that measures the level of the process (not only its changes).

        If there is only one kind, or if no kind measures the level, these are all samples.
        """
        kinds = self.by_name("").values()
        return next((of for of in kinds if isinstance(of.stencil, Stencil) and of.stencil.measures_levels), self)

    @cached_property
    def ladder(self) -> Ladder:
        """Cosines and sines as the samples measure them, of which `Fourier` makes covariances; cached, as they do not
        depend on hyperparameters.
        """
        return Ladder(self.times, self.relative_noise, self.stencil)

    @cached_property
    def scatter(self) -> ResidualStatistics:
        """The residuals of all samples that were replaced by these; empty if no samples were replaced."""
        return sum(self.scatters, ResidualStatistics())

    def mean_square(self, off: Array) -> float:
        """Return the mean square of the residuals `off` (n,), which are the samples minus a signal.

        If these samples represent more samples, the mean is that over all the represented samples, weighted by the
        inverse of their relative variances.
        """
        if not self.scatters:
            return float(np.mean(off**2))
        w = 1 / self.relative_variance
        return float((w @ off**2 + self.scatter.squares) / np.sum(w))

    @cached_property
    def relative_variance(self) -> Array:
        """ϱ_i², shape (n,): the variance of the noise of sample i is σ_n² ϱ_i²."""
        return np.asarray(self.relative_noise**2)

    @cached_property
    def centres(self) -> Array:
        """The times [s] at which the samples depend on the process (`Stencil.centres`); cached."""
        return self.stencil.centres(self.times)

    def covariance(self, kernel: Kernel) -> tuple[Array, Array]:
        """Return the covariance (n, n) of the samples, without noise, and its ∂/∂ln θ_j, shape (p, n, n)."""
        return self.stencil.covariance_at(kernel, self._apart)

    @cached_property
    def _apart(self) -> Array:
        """t_i − t_j [s], shape (n, n); cached, as it does not depend on hyperparameters."""
        return np.subtract.outer(self.times, self.times)

    def __len__(self) -> int:
        return self.times.size

    def __repr__(self) -> str:
        span = f"{self.times[0]:.12g} s to {self.times[-1]:.12g} s"
        return f"Samples({len(self)} from {span}, values from {self.values.min():.6g} to {self.values.max():.6g})"


def recorded_span(samples: Iterable[Samples]) -> tuple[float, float]:
    """Return the first and the last time of several samples [s]."""
    times = [of.times for of in samples]
    return float(min(t[0] for t in times)), float(max(t[-1] for t in times))
