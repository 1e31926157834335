"""What samples say of rows: their posterior mean and covariance, and the function that multipliers of them make."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackable.arrays import Array
from trackable.gp.joint import JointPosterior
from trackable.gp.posterior import Posterior
from trackable.gp.rows import Rows, Terms
from trackable.gp.signal import KernelSum


@dataclass(frozen=True)
class RowPosterior:
    """The n `rows` of processes given samples. Raises IllConditioned as the `posterior` does."""

    posterior: JointPosterior
    rows: Rows

    @cached_property
    def mean(self) -> Array:
        """L m⁺ with the offsets, shape (n,)."""
        return self.rows.values(self.posterior.signals)

    @cached_property
    def covariance(self) -> Array:
        """K⁺_ab = L_a L_b κ⁺, shape (n, n)."""
        parts = (self._covariance(*pair) for pair in zip(self.posterior.parts, self.rows.terms, strict=True))
        return np.asarray(sum(parts, np.zeros((len(self.rows), len(self.rows)))))

    def signals(self, multipliers: Array) -> tuple[KernelSum, ...]:
        """Return m⁺ + Σ_a ν_a κ⁺(·, L_a) of each process: again sums of kernels, for multipliers ν of shape (n,)."""
        return tuple(
            part.with_kernels(terms.times, terms.spread(multipliers)) if len(terms.times) else part.signal
            for part, terms in zip(self.posterior.parts, self.rows.terms, strict=True)
        )

    def price_gradient(self, multipliers: Array) -> Array:
        """Return ∂/∂ln θ of 2 νᵀ(b − L m⁺) − νᵀ K⁺ ν at held multipliers ν and bounds b: shape (p,).

        With the weights w of m⁺ + Σ_a ν_a κ⁺(·, L_a) on all centres, it is the difference of −wᵀ ∂G w with and without
        the rows, G being the Gram matrix of all centres: no term for L m⁺ or K⁺ is needed.
        """
        gradient = np.zeros(len(self.posterior.prior.learned))
        none = np.empty(0)
        for part, terms, places in zip(
            self.posterior.parts, self.rows.terms, self.posterior.prior.places, strict=True
        ):
            with_rows = part.energy_gradient(terms.times, terms.spread(multipliers))
            gradient[places] += part.energy_gradient(none, none) - with_rows
        return gradient

    def _covariance(self, part: Posterior, terms: Terms) -> Array:
        n = len(self.rows)
        before = part.prior.kernel(terms.times[:, None] - terms.times)
        among = terms.summed(terms.summed(before, n).T, n)
        across = terms.summed(part.cross_covariance(terms.times), n)
        covariance = among - across @ part.solve(across.T)
        return np.asarray((covariance + covariance.T) / 2)
