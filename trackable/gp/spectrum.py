"""Eigenvalues of a covariance matrix K = θ₁² C, for likelihoods at many amplitudes θ₁ of one kernel."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from trackable.arrays import Array
from trackable.gp.factors.chebyshev import Bases
from trackable.gp.kernels.base import Kernel
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.samples import Samples
from trackable.gp.stencil import Stencil

_FEWEST = 150  # samples: for fewer, computing all eigenvalues is faster


class Spectrum(NamedTuple):
    """C = ϱ U diag(λ) Uᵀ ϱ with relative noise ϱ and k orthonormal columns U, and samples y with prior mean m.

    `power` is λ (k,), `along` is s = Uᵀ ϱ⁻¹ (y − m) (k,), and `rest` is |ϱ⁻¹ (y − m)|² − |s|². Weights ϱ⁻¹ U b of
    the samples give the sum of kernels centred at `instants` [s] (m,) with weights `lift` b, `lift` being (m, k).
    Those of several kernels may be stacked: `power`, `along` and `lift` have their places as first axis then.
    """

    power: Array
    along: Array
    rest: float
    instants: Array
    lift: Array

    @classmethod
    def of(cls, samples: Samples, kernel: Kernel, residual: Array) -> "Spectrum":
        """Decompose for n samples and a kernel: k = n, or the number of points that resolve the kernel."""
        scaled, stencil = residual / samples.relative_noise, samples.stencil
        if not isinstance(stencil, Stencil):
            return cls._of_whole(samples, stencil.between(kernel, samples.times), scaled)
        value = partial(stencil.value, kernel.value)
        first, bases = _start_and_bases(samples, kernel)
        may_be_few = len(samples) >= _FEWEST and kernel.is_analytic
        if may_be_few and (count := bases.points_for(stencil.covariance(kernel), len(samples) // 2)):
            points, _, q, r = bases.of(count)
            power, vectors = np.linalg.eigh(r @ value(points[:, None] - points) @ r.T)
            along = vectors.T @ (scaled @ q)
            return cls(power, along, float(scaled @ scaled - along @ along), first + points, r.T @ vectors)
        return cls._of_whole(samples, value(samples.times[:, None] - samples.times), scaled)

    @classmethod
    def stacked(cls, samples: Samples, kernel: Callable[[Array], Array], residual: Array) -> "Spectrum":
        """Decompose for b kernels at once, each at r[i] of an array r (b, …), and samples that `can_be_stacked`."""
        assert isinstance(samples.stencil, Stencil), "covariances of several kinds of samples are not stacked"
        whole = samples.stencil.value(kernel, (samples.times[:, None] - samples.times)[None])
        return cls._of_whole(samples, whole, residual / samples.relative_noise)

    @classmethod
    def _of_whole(cls, samples: Samples, whole: Array, scaled: Array) -> "Spectrum":
        """Decompose matrices C of shape (…, n, n)."""
        power, vectors = np.linalg.eigh(whole / np.outer(samples.relative_noise, samples.relative_noise))
        return cls(power, scaled @ vectors, 0.0, samples.times, vectors / samples.relative_noise[:, None])


def can_be_stacked(samples: Samples) -> bool:
    """Whether all eigenvalues are computed whatever the kernel, for samples of one kind."""
    return len(samples) < _FEWEST and isinstance(samples.stencil, Stencil)


def _start_and_bases(samples: Samples, kernel: Kernel) -> tuple[float, Bases]:
    """Return the time [s] of the first point, and bases: within one period if the kernel has one that is short."""
    if isinstance(kernel, Periodic) and kernel.period < samples.bases.span:
        return 0.0, Bases(samples.times % kernel.period, samples.relative_noise, kernel.period)
    return float(samples.times[0]), samples.bases
