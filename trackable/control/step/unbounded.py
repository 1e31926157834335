"""The optimum without any bound: linear in the error, and the optimum itself wherever it happens to keep the bounds."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve, null_space

from trackable.arrays import Array
from trackable.control.step.prediction import Prediction


@dataclass(frozen=True, eq=False)
class Unbounded:
    """min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R subject to the prediction and e(N) = 0.

    An interior-point method finds a minimum of a quadratic cost to the square root of its accuracy only: an error of
    1e-6 costs 1e-12. Close to the reference that would be all there is, so there this formula answers, to rounding.
    """

    prediction: Prediction
    Q: Array
    R: Array

    def inputs(self, unforced: Array) -> Array:
        """The optimal v(0), …, v(N−1), shape (N, m), where without inputs the errors are `unforced` (N, n)."""
        N, _, m = self.prediction.B.shape
        return np.asarray((self._gain @ unforced.ravel()).reshape(N, m))

    @cached_property
    def _gain(self) -> Array:
        """V = K f for f = Φ e(0) + Ψ d: V takes f(N) to zero at the least norm, and Z w does what else is worth it.

        V = −Γ_N⁺ f(N) + Z w with Γ_N Z = 0, and w minimises Vᵀ S V + 2 Vᵀ Γᵀ Q̄ f for S = Γᵀ Q̄ Γ + R̄.
        """
        (N, n, _), forced = self.prediction.A.shape, self.prediction.forced
        last = forced[-n:]
        weighted = forced.T @ np.kron(np.eye(N), self.Q)
        hessian = weighted @ forced + np.kron(np.eye(N), self.R)
        landing = np.zeros((forced.shape[1], N * n))
        landing[:, -n:] = -np.linalg.pinv(last)
        Z = null_space(last)
        if not Z.size:
            return landing
        slope = Z.T @ (weighted + hessian @ landing)
        return np.asarray(landing - Z @ cho_solve(cho_factor(Z.T @ hessian @ Z), slope))
