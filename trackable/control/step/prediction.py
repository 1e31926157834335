"""What a controller predicts with: an affine time-varying model of the error along a reference."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackable.arrays import Array
from trackable.systems.constrained import System
from trackable.systems.reference import Window


@dataclass(frozen=True, eq=False)
class Prediction:
    """e(i+1) = A_i e(i) + B_i v(i) + d_i for i < N, with `A` (N, n, n) and `B` (N, n, m).

    e = x − x_r and v = u − u_r are errors. The `gaps` d (N, n) are given with each question: what the reference itself
    fails to follow, zero up to rounding where x_r and u_r belong together, and what a linearisation is off.

    Stacked, with E = (e(1), …, e(N)) and V = (v(0), …, v(N−1)), it is E = Φ e(0) + Γ V + Ψ d.
    """

    A: Array
    B: Array

    @classmethod
    def along(cls, system: System, plan: Window) -> "Prediction":
        """The slopes of f along a plan; those of a linear system are the same along all."""
        return cls(*system.slopes(plan.states[:-1], plan.inputs))

    @property
    def horizon(self) -> int:
        """N."""
        return len(self.A)

    def errors(self, start: Array, inputs: Array, gaps: Array) -> Array:
        """e(1), …, e(N), shape (N, n), after `start` e(0) (n,) under `inputs` v (N, m)."""
        return self.unforced(start, gaps) + (self.forced @ inputs.ravel()).reshape(gaps.shape)

    def unforced(self, start: Array, gaps: Array) -> Array:
        """Φ e(0) + Ψ d, shape (N, n): what happens without any input error."""
        return np.asarray((self.free @ start + self.drift @ gaps.ravel()).reshape(gaps.shape))

    @cached_property
    def free(self) -> Array:
        """Φ, shape (N n, n)."""
        products = [self.A[0]]
        for A in self.A[1:]:
            products.append(A @ products[-1])
        return np.vstack(products)

    @cached_property
    def drift(self) -> Array:
        """Ψ, shape (N n, N n): in block (i, j) A_i … A_(j+1), what d_j has become in e(i+1)."""
        N, n, _ = self.A.shape
        blocks = np.zeros((N, n, N, n))
        for i in range(N):
            if i:
                blocks[i] = np.einsum("ab,bjc->ajc", self.A[i], blocks[i - 1])
            blocks[i, :, i] = np.eye(n)
        return blocks.reshape(N * n, N * n)

    @cached_property
    def forced(self) -> Array:
        """Γ, shape (N n, N m)."""
        N, n, m = self.B.shape
        by_step = self.drift.reshape(N * n, N, n)
        return np.asarray(np.einsum("rjn,jnm->rjm", by_step, self.B).reshape(N * n, N * m))


def gaps(system: System, window: Window) -> Array:
    """d_i = f(x_r(i), u_r(i)) − x_r(i+1), shape (N, n): what the reference fails to follow."""
    return np.asarray(system.successor(window.states[:-1], window.inputs) - window.states[1:])


def gaps_near(prediction: Prediction, system: System, window: Window, plan: Window) -> Array:
    """d_i = f(x̄(i), ū(i)) − A_i (x̄(i) − x_r(i)) − B_i (ū(i) − u_r(i)) − x_r(i+1), shape (N, n), near a plan x̄, ū.

    On the plan the prediction is then exact; near it, to first order.
    """
    e, v = plan.states[:-1] - window.states[:-1], plan.inputs - window.inputs
    ahead = np.einsum("iab,ib->ia", prediction.A, e) + np.einsum("iam,im->ia", prediction.B, v)
    return np.asarray(system.successor(plan.states[:-1], plan.inputs) - ahead - window.states[1:])
