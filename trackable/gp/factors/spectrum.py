"""A covariance matrix by its eigenvalues, where many amplitudes of one kernel are of interest: K = θ₁² C."""

from typing import NamedTuple

import numpy as np

from trackable.arrays import Array
from trackable.gp.factors.bases import Bases
from trackable.gp.kernels.base import Kernel
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.samples import Samples

_FEWEST = 150  # samples: fewer, and all eigenvalues are found sooner than how many matter


class Spectrum(NamedTuple):
    """C = ϱ U diag(λ) Uᵀ ϱ with relative noise ϱ and k orthonormal columns U, and samples y less their prior mean m.

    `power` is λ (k,), `along` is s = Uᵀ ϱ⁻¹ (y − m) (k,), and `rest` what is left of |ϱ⁻¹ (y − m)|² without |s|².
    With weights ϱ⁻¹ U b of the samples, a sum of kernels has the weights `lift` b at the `instants` [s]: shapes (m, k)
    and (m,).
    """

    power: Array
    along: Array
    rest: float
    instants: Array
    lift: Array

    @classmethod
    def of(cls, samples: Samples, kernel: Kernel, residual: Array) -> "Spectrum":
        """Of n samples and a kernel of any amplitude; where fewer points resolve it, their number is the size."""
        uneven, stencil = residual / samples.relative_noise, samples.stencil
        first, bases = _placed(samples, kernel)
        many = len(samples) >= _FEWEST and kernel.is_analytic
        if many and (count := bases.points_for(stencil.covariance(kernel), len(samples) // 2)):
            points, q, r = bases.of(count)
            power, vectors = np.linalg.eigh(r @ stencil.value(kernel, points[:, None] - points) @ r.T)
            along = vectors.T @ (uneven @ q)
            return cls(power, along, float(uneven @ uneven - along @ along), first + points, r.T @ vectors)
        whole = stencil.value(kernel, samples.times[:, None] - samples.times)
        power, vectors = np.linalg.eigh(whole / np.outer(samples.relative_noise, samples.relative_noise))
        return cls(power, vectors.T @ uneven, 0.0, samples.times, vectors / samples.relative_noise[:, None])


def _placed(samples: Samples, kernel: Kernel) -> tuple[float, Bases]:
    """Where points begin [s], and what interpolates from them: in a period where there is one, and it is short."""
    if isinstance(kernel, Periodic) and kernel.period < samples.bases.span:
        return 0.0, Bases(samples.times % kernel.period, samples.relative_noise, kernel.period)
    return float(samples.times[0]), samples.bases
