"""The optimum without bounds: linear in the error, and the optimum with bounds wherever it happens to keep them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.control.step.error_model import ErrorModel


@dataclass(frozen=True, eq=False)
class LinearQuadratic:
    """min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R subject to the error model and e(N) = 0, without bounds.

    An interior-point method finds a minimum of a quadratic cost only up to the square root of its accuracy: a cost of
    1e-12 is an error of 1e-6. Close to the reference that error would dominate. There this formula is used, which is
    exact up to rounding. Raises ArithmeticError where predictions overflow, and numpy's LinAlgError where the cost has
    no unique minimum in floating point.
    """

    model: ErrorModel
    Q: Array
    R: Array

    def input_errors(self, unforced_errors: Array) -> Array:
        """Return the optimal v(0), …, v(N−1), shape (N, m), given the errors for v = 0, shape (N, n)."""
        N, _, m = self.model.B.shape
        return np.asarray((self.gain @ unforced_errors.ravel()).reshape(N, m))

    @cached_property
    def gain(self) -> Array:
        """K in V = K f with f = Φ e(0) + Ψ d: the null-space method for the terminal constraint f(N) + Γ_N V = 0.

        V = −Γ_N⁺ f(N) + Z w with Γ_N Z = 0, and w minimises Vᵀ S V + 2 Vᵀ Γᵀ Q̄ f for S = Γᵀ Q̄ Γ + R̄.
        """
        (N, n, _), forced = self.model.A.shape, self.model.forced
        last = forced[-n:]
        weighted = forced.T @ np.kron(np.eye(N), self.Q)
        hessian = weighted @ forced + np.kron(np.eye(N), self.R)
        if not np.all(np.isfinite(hessian)):
            raise ArithmeticError("predictions over the horizon overflow")
        to_reference = np.zeros((forced.shape[1], N * n))
        to_reference[:, -n:] = -np.linalg.pinv(last)
        Z = scipy.linalg.null_space(last)
        if not Z.size:
            return to_reference
        slope = Z.T @ (weighted + hessian @ to_reference)
        return np.asarray(to_reference - Z @ scipy.linalg.cho_solve(scipy.linalg.cho_factor(Z.T @ hessian @ Z), slope))
