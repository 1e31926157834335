"""The program of a step within a trust region: bounds are kept, while the dynamics may be missed at a price."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import clarabel
import numpy as np
from scipy import sparse

from trackably.arrays import Array
from trackably.control.step.scales import Scales
from trackably.control.step.slack import Inequalities, PlantInequalities

_TOLERANCE = 1e-10
_PROXIMAL = 1e-6
"""The weight of a step's own size: it chooses among steps that are equally good."""

_SOLVED = ("Solved", "AlmostSolved")


class Linearised(NamedTuple):
    """What a step starts from, in scales: slopes A (N, n, n) and B (N, n, m) along a trajectory, its `defects`
    f(x_i, u_i) − x_(i+1) (N, n), and its distances e (N + 1, n) and v (N, m) from the reference."""

    A: Array
    B: Array
    defects: Array
    e: Array
    v: Array

    @property
    def dynamics(self) -> sparse.csc_array:
        """The matrix of A_i δe_i + B_i δv_i − δe_(i+1), shape (N n, (N − 1) n + N m), with δe_0 = δe_N = 0."""
        N, n, _ = self.B.shape
        by_state = np.zeros((N, n, N + 1, n))
        by_state[np.arange(N), :, np.arange(N)] = self.A
        by_state[np.arange(N), :, np.arange(1, N + 1)] = -np.eye(n)
        inner = sparse.csc_array(by_state[:, :, 1:-1].reshape(N * n, (N - 1) * n))
        return sparse.csc_array(sparse.hstack([inner, sparse.block_diag(list(self.B))]))

    @property
    def least_change(self) -> "Change":
        """The least change, in the Euclidean norm, after which no dynamics are missed, to first order; bounds are not
        kept."""
        return self.change(-np.linalg.lstsq(self.dynamics.toarray(), self.defects.ravel())[0])

    def change(self, x: Array) -> "Change":
        """Return changes of states and inputs, given as one vector x."""
        N, n, m = self.B.shape
        states, inputs = np.split(x, [(N - 1) * n])
        defects = self.defects + (self.dynamics @ x).reshape(N, n)
        return Change(states.reshape(N - 1, n), inputs.reshape(N, m), defects)

    @property
    def is_defined(self) -> bool:
        """Whether all numbers are finite."""
        return all(bool(np.all(np.isfinite(values))) for values in self)


class Change(NamedTuple):
    """Changes of the inner states x(1), …, x(N − 1), shape (N − 1, n), and of the inputs (N, m), in scales; `defects`
    (N, n) are those after them, to first order."""

    states: Array
    inputs: Array
    defects: Array

    @property
    def missed(self) -> float:
        """Σ_i ‖defect_i‖₁ after the changes, to first order."""
        return float(np.sum(np.abs(self.defects)))

    @property
    def size(self) -> float:
        """The largest change of all."""
        return float(max(np.max(np.abs(self.states), initial=0.0), np.max(np.abs(self.inputs))))


@dataclass(frozen=True, eq=False)
class ElasticProgram:
    """min w V(e + δe, v + δv) + Σ_i ‖d_i + A_i δe_i + B_i δv_i − δe_(i+1)‖₁ with |δe| ≤ Δ, |δv| ≤ Δ and bounds kept.

    V = Σ_i ‖e_i‖²_Q + ‖v_i‖²_R, with Q and R in scales. The first and the last state are given and do not change. The
    program has a solution from wherever the bounds are kept: no change at all satisfies its constraints. (The ℓ1
    penalty is exact, see Fletcher: Practical Methods of Optimization, section 14.4.)
    """

    scales: Scales
    inequalities: PlantInequalities
    horizon: int
    Q: Array
    R: Array

    def change(self, at: Linearised, slack: Array, weight: float, radius: float) -> Change | None:
        """Return the best change for w = `weight` ≥ 0 and Δ = `radius`; None where the solver finds none.

        `slack` (rows of `bounds`,) is what the trajectory leaves to its bounds, in parts of the widths.
        """
        dynamics, defects = at.dynamics, at.defects.ravel()
        count, equations = dynamics.shape[1], defects.size
        each, missed = sparse.eye_array(count, format="csc"), sparse.eye_array(equations, format="csc")
        rows = sparse.block_array(
            [[dynamics, -missed], [-dynamics, -missed], [self.bounds, None], [each, None], [-each, None]], format="csc"
        )
        limits = np.concatenate([-defects, defects, np.maximum(slack, 0.0), np.full(2 * count, radius)])
        half = sparse.block_diag([weight * self._weights + _PROXIMAL * each, sparse.csc_array((equations, equations))])
        linear = np.concatenate([2 * weight * (self._weights @ _joined(at.e[1:-1], at.v)), np.ones(equations)])
        cone = [clarabel.NonnegativeConeT(len(limits))]
        found = clarabel.DefaultSolver(2 * half.tocsc(), linear, rows, limits, cone, _settings()).solve()
        x = np.asarray(found.x)[:count]
        if str(found.status) not in _SOLVED or not np.all(np.isfinite(x)):
            return None
        return at.change(x)

    @cached_property
    def bounds(self) -> sparse.csc_array:
        """The rows of X for inner states and those of U for inputs, in scales and in parts of the widths."""
        X, U = self.inequalities.states, self.inequalities.inputs
        return sparse.csc_array(
            sparse.block_diag(
                [
                    sparse.kron(sparse.eye_array(self.horizon - 1), _scaled(X, self.scales.states)),
                    sparse.kron(sparse.eye_array(self.horizon), _scaled(U, self.scales.inputs)),
                ]
            )
        )

    @cached_property
    def _weights(self) -> sparse.csc_array:
        """V of inner states and inputs as a matrix."""
        inner, inputs = sparse.eye_array(self.horizon - 1), sparse.eye_array(self.horizon)
        return sparse.csc_array(sparse.block_diag([sparse.kron(inner, self.Q), sparse.kron(inputs, self.R)]))


def _scaled(inequalities: Inequalities, scales: Array) -> sparse.csc_array:
    return sparse.csc_array(inequalities.rows * scales / inequalities.widths[:, None])


def _joined(states: Array, inputs: Array) -> Array:
    return np.concatenate([states.ravel(), inputs.ravel()])


def _settings() -> clarabel.DefaultSettings:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    settings.max_iter = 50
    settings.max_threads = 1
    return settings
