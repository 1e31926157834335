"""The posterior of rows (linear functionals, such as values and derivatives at single times) given samples.

It has the mean and the covariance of the rows, and the function for given Lagrange multipliers, one for each row.
"""

from dataclasses import dataclass
from functools import cached_property as cached

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.row_system import RowSystem
from trackably.gp.rows import RowKernel, Rows, row_kernel
from trackably.gp.signal import KernelSum


@dataclass(frozen=True)
class RowPosterior:
    """The posterior of n `rows` (linear functionals L_a of the processes), with covariance K⁺.

    Raises IllConditioned, on first use, if the covariance of the samples cannot be factored.
    """

    posterior: JointPosterior
    rows: Rows

    @cached
    def mean(self) -> Array:
        """The values of the rows (linear functionals L_a) for the posterior means m⁺: L m⁺ plus offsets, shape (n,)."""
        return self.rows.values(self.posterior.signals)

    @cached
    def covariance(self) -> Array:
        """The posterior covariance of the rows: K⁺_ab = L_a L_b κ⁺, shape (n, n)."""
        total = np.zeros((len(self.rows), len(self.rows)))
        for part, kernel, across in zip(self.posterior.parts, self._kernels, self._across, strict=True):
            own = kernel.among() - across @ part.solve(across.T)
            total += (own + own.T) / 2
        return total

    @cached
    def rounding(self) -> Array:
        """The rounding errors of the variances of the rows (linear functionals), shape (n,)."""
        return np.asarray(sum((kernel.rounding for kernel in self._kernels), np.zeros(len(self.rows))))

    def signals(self, multipliers: Array) -> tuple[KernelSum, ...]:
        """Return m⁺ + Σ_a ν_a κ⁺(·, L_a) of each process as a sum of kernels, for `multipliers` ν (n,) of rows L_a."""
        every = zip(self.posterior.parts, self._kernels, self._weights(multipliers), strict=True)
        return tuple(
            part.with_kernels(own, kernel.centres.times, kernel.centres.spread(multipliers))
            for part, kernel, own in every
        )

    def price_gradient(self, multipliers: Array) -> Array:
        """Return ∂/∂ln θ of the price 2 νᵀ(b − L m⁺) − νᵀ K⁺ ν for fixed multipliers ν and bounds b, shape (p,).

        The price is what the bounds cost, in the unit of l.

        Let w be the weights of m⁺ + Σ_a ν_a κ⁺(·, L_a) on samples and rows, and G the Gram matrix of these. The
        gradient is the difference of −wᵀ ∂G w with and without the rows, so neither L m⁺ nor K⁺ has to be
        differentiated.
        """
        gradient = np.zeros(len(self.posterior.prior.learned))
        parts = zip(self.posterior.parts, self._kernels, self._weights(multipliers), strict=True)
        for (part, kernel, own), places in zip(parts, self.posterior.prior.places, strict=True):
            by_rows = kernel.energy_gradient(multipliers, part.samples.centres, part.samples.stencil.spread(own))
            energy = part.energy_gradient(own) + np.append(by_rows, 0.0)[part.prior.places]
            gradient[places] += part.energy_gradient(part.weights) - energy
        return gradient

    @cached
    def system(self) -> RowSystem | None:
        """A form of K⁺ that solves equations faster than the dense `covariance`; None if there is none."""
        if not has_system(self.posterior, len(self.rows)):
            return None
        return RowSystem.of(self.posterior.parts[0], self.rows.terms[0], len(self.rows))

    def _weights(self, multipliers: Array) -> list[Array]:
        """Return the weights of each process's samples in m⁺ + Σ_a ν_a κ⁺(·, L_a), for `multipliers` ν (n,): (n_c,).

        They are c − A⁻¹ x, with the weights c of m⁺, A = K + σ_n² I, and the covariances x of samples with Σ_a ν_a L_a.
        """
        cross = [self.system.cross(multipliers)] if self.system else [multipliers @ across for across in self._across]
        return [part.weights - part.solve(of) for part, of in zip(self.posterior.parts, cross, strict=True)]

    @cached
    def _kernels(self) -> tuple[RowKernel, ...]:
        pairs = zip(self.posterior.parts, self.rows.terms, strict=True)
        return tuple(row_kernel(part.prior.kernel, terms, len(self.rows)) for part, terms in pairs)

    @cached
    def _across(self) -> tuple[Array, ...]:
        """For each process, the prior covariances of rows (linear functionals) and samples."""
        pairs = zip(self._kernels, self.posterior.samples, strict=True)
        return tuple(of.stencil.combine(kernel.across(of.centres)) for kernel, of in pairs)


MANY_ROWS = 200  # rows: for fewer, their dense covariance takes less time


def has_system(posterior: JointPosterior, count: int) -> bool:
    """Whether equations for `count` rows (linear functionals) are solved by a `RowSystem`, together with the samples.

    This needs many rows, a single process, and a kernel that is a sum of polynomials times e^(−λ|r|) (`decays`).
    """
    return count >= MANY_ROWS and len(posterior.parts) == 1 and bool(posterior.prior.parts[0].kernel.decays)
