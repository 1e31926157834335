"""A process that is known from earlier samples, given more of them: the update of its mean by windows.

Given y₁ the mean of g is g₁ = m + Σ_i c_i κ(·, t_i). Given y₁ and y₂ it is g₁ + δ, where δ is what a process of mean
zero has for mean given zeros in place of y₁, and y₂ − g₁: its covariance given zeros is that given y₁, which does not
depend on values. Of the zeros only those within the kernel's memory matter.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.posterior import Posterior
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum
from trackably.learning.problem import ConstrainedProblem


@dataclass(frozen=True)
class Continued(Posterior):
    """The posterior of a process whose mean is `base` before these samples: its kernel is the prior's, all is known."""

    base: KernelSum

    def with_kernels(self, own: Array, t: Array, weights: Array) -> KernelSum:
        return together(self.base, super().with_kernels(own, t, weights))

    @cached_property
    def _residual(self) -> Array:
        return self.samples.values - self.samples.stencil.measured(self.base, self.samples.times)


@dataclass(frozen=True)
class JointlyContinued(JointPosterior):
    """Processes whose means are `bases` before their samples."""

    bases: tuple[KernelSum, ...]

    @cached_property
    def parts(self) -> tuple[Posterior, ...]:
        each = zip(self.prior.parts, self.samples, self.bases, strict=True)
        return tuple(Continued(*of_process) for of_process in each)


@dataclass(frozen=True)
class ContinuedProblem(ConstrainedProblem):
    """Learn how functions go on from `bases`, for hyperparameters that are all known."""

    bases: tuple[KernelSum, ...] = ()

    def posterior(self, log_theta: Array) -> JointPosterior:
        return JointlyContinued(self.prior, self.samples, self.bases)


def together(base: KernelSum, more: KernelSum) -> KernelSum:
    """Return the sum of two deviations from one mean."""
    centres, weights = np.append(base.centres, more.centres), np.append(base.weights, more.weights)
    return KernelSum.of_terms(base.kernel, base.mean, centres, weights)


def part_of(samples: Samples, start: float, end: float) -> Samples | None:
    """Return the samples from `start` up to before `end` [s], without what others say of the noise; None: none."""
    at = np.flatnonzero((start <= samples.times) & (samples.times < end))
    if not len(at):
        return None
    return Samples(samples.times[at], samples.values[at], samples.relative_noise[at], samples.stencil.only(at))


def with_memory(samples: Samples, base: KernelSum, since: float, now: float, end: float) -> Samples | None:
    """Return the samples from `now` to `end` [s], after those since `since`, whose values are those of `base`.

    Where there are none since then, the last one before is all. None where there are none before `end`.
    """
    found = part_of(samples, since, end)
    if found is None and samples.times[0] < since:
        found = part_of(samples, float(samples.times[samples.times < since][-1]), end)
    if found is None:
        return None
    values = np.where(found.times < now, found.stencil.measured(base, found.times), found.values)
    return Samples(found.times, values, found.relative_noise, found.stencil)
