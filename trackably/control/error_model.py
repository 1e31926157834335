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

    e = (x − x_r) / s_x is the error of the state and v = (u − u_r) / s_u that of the input, in scales s. The defects d
    are given with each prediction. They contain the reference's own defects (zero up to rounding if u_r belongs to x_r)
    and the error of a linearisation.

    Stacked in one vector z = (e(0), …, e(N), v(0), …, v(N−1)), the model reads `dynamics` z = −d.
    """

    A: Array
    B: Array

    @classmethod
    def along(cls, system: System, nominal: Window, scales: Scales) -> "ErrorModel":
        """Linearise the system along a `nominal` trajectory. For a linear system the result does not depend on it."""
        A, B = system.slopes(nominal.states[:-1], nominal.inputs)
        x, u = scales.states, scales.inputs
        return cls(A * x / x[:, None], B * u / x[:, None])

    @property
    def horizon(self) -> int:
        """The horizon N, in steps."""
        return len(self.A)

    @cached_property
    def dynamics(self) -> Array:
        """The matrix of A_i e(i) + B_i v(i) − e(i+1), shape (N n, (N + 1) n + N m)."""
        (N, n, m), i = self.B.shape, np.arange(self.horizon)
        of_states, of_inputs = np.zeros((N, n, N + 1, n)), np.zeros((N, n, N, m))
        of_states[i, :, i], of_states[i, :, i + 1], of_inputs[i, :, i] = self.A, -np.eye(n), self.B
        return np.hstack([of_states.reshape(N * n, (N + 1) * n), of_inputs.reshape(N * n, N * m)])

    def predict(self, z: Array, defects: Array) -> Array:
        """Return z with its e(1), …, e(N) replaced by those that follow from its e(0), its v and the defects (N n,)."""
        N, n, m = self.B.shape
        found = z.copy()
        e, v = found[: (N + 1) * n].reshape(-1, n), found[(N + 1) * n :].reshape(-1, m)
        for i, d in enumerate(defects.reshape(N, n)):
            e[i + 1] = self.A[i] @ e[i] + self.B[i] @ v[i] + d
        return found
