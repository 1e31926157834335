"""The prediction model of a controller, along a reference."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.control.bounds import Scales
from trackably.systems.constrained import System
from trackably.systems.reference import Window


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """e(i+1) = A_i e(i) + B_i v(i) + d_i for i < N, with `A` (N, n, n) and `B` (N, n, m).

    e = x − x_r is the error of the state, v = u − u_r that of the input. The defects d (N, n) are given with each
    prediction. They contain the reference's own defects (zero up to rounding if u_r belongs to x_r) and the error of a
    linearisation.

    Stacked, with E = (e(1), …, e(N)) and V = (v(0), …, v(N−1)), the model reads E = Φ e(0) + Γ V + Ψ d.
    """

    A: Array
    B: Array

    @classmethod
    def along(cls, system: System, nominal: Window) -> "ErrorModel":
        """Linearise the system along a `nominal` trajectory. For a linear system the result does not depend on it."""
        return cls(*system.slopes(nominal.states[:-1], nominal.inputs))

    @property
    def horizon(self) -> int:
        """N, in steps."""
        return len(self.A)

    def scaled(self, scales: Scales) -> "ErrorModel":
        """Return the model of e / s_x and v / s_u."""
        x, u = scales.states, scales.inputs
        return ErrorModel(self.A * x / x[:, None], self.B * u / x[:, None])

    def errors(self, initial_error: Array, input_errors: Array, defects: Array) -> Array:
        """Predict e(1), …, e(N), shape (N, n), from e(0) (n,), the input errors v (N, m) and the defects d (N, n)."""
        unforced = self.free @ initial_error + self.drift @ defects.ravel()
        return np.asarray((unforced + self.forced @ input_errors.ravel()).reshape(defects.shape))

    @cached_property
    def free(self) -> Array:
        """Φ, shape (N n, n): the response to the initial error."""
        products = [self.A[0]]
        for A in self.A[1:]:
            products.append(A @ products[-1])
        return np.vstack(products)

    @cached_property
    def drift(self) -> Array:
        """Ψ, shape (N n, N n): the response to the defects.

        Block (i, j) is A_i … A_(j+1), the effect of d_j on e(i+1).
        """
        N, n, _ = self.A.shape
        blocks = np.zeros((N, n, N, n))
        for i in range(N):
            if i:
                blocks[i] = np.einsum("ab,bjc->ajc", self.A[i], blocks[i - 1])
            blocks[i, :, i] = np.eye(n)
        return blocks.reshape(N * n, N * n)

    @cached_property
    def forced(self) -> Array:
        """Γ, shape (N n, N m): the response to the input errors."""
        N, n, m = self.B.shape
        by_step = self.drift.reshape(N * n, N, n)
        return np.asarray(np.einsum("rjn,jnm->rjm", by_step, self.B).reshape(N * n, N * m))


def reference_defects(system: System, window: Window) -> Array:
    """Return d_i = f(x_r(i), u_r(i)) − x_r(i+1), shape (N, n): the mismatch between the system and the reference."""
    return np.asarray(system.successor(window.states[:-1], window.inputs) - window.states[1:])


def linearisation_defects(model: ErrorModel, system: System, window: Window, nominal: Window) -> Array:
    """Return d_i = f(x̄(i), ū(i)) − A_i (x̄(i) − x_r(i)) − B_i (ū(i) − u_r(i)) − x_r(i+1), shape (N, n).

    x̄, ū is the `nominal` trajectory of the linearisation. With these defects the model is exact on it, and exact to
    first order near it.
    """
    e, v = nominal.states[:-1] - window.states[:-1], nominal.inputs - window.inputs
    linear = np.einsum("iab,ib->ia", model.A, e) + np.einsum("iam,im->ia", model.B, v)
    return np.asarray(system.successor(nominal.states[:-1], nominal.inputs) - linear - window.states[1:])
