"""The optimum of a tube controller where bounds are active: the point of a polyhedron that is nearest to another."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from trackably.arrays import Array
from trackably.control.step.error_model import ErrorModel
from trackably.control.step.formulation import Formulation
from trackably.control.step.slack import Slack
from trackably.control.tube.least_distance import nearest_in
from trackably.control.tube.nearest import Nearest
from trackably.control.tube.value import square_root

_ACCURACY = 1e-9
"""Bounds may be broken by this part of their widths, and Z be left by this part of its own."""

_MOST_ROUNDS = 40
_WORST_CONDITION = 1e8
_FLAT = 1e-3
"""Of the scales: Z counts as wider by this much, so that `_ACCURACY` means something where it is flat."""


@dataclass(frozen=True, eq=False)
class BoundedOptimum:
    """min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R with x − z(0) ∈ Z, e(N) = 0, and e, v within their slack.

    Plans p = (e(0), v(0), …, v(N − 1), d) with defects d (N n,) that end on the reference are p = `_basis` q + `_drift`
    d, in such coordinates q that the cost is ‖q − q_d‖² + const, with q_d linear in d. So the optimum is the point of a
    polyhedron that is nearest to q_d. Its rows are the bounds that some q on the way breaks, and half-spaces that hold
    Z.
    """

    formulation: Formulation
    nearest: Nearest

    def solve(self, off: Array, defects: Array, start_slack: Array, slack: Slack) -> tuple[Array, Array] | None:
        """Return the optimal e(0) (n,) and v (N, m), scaled; None where there are none. LinAlgError: not found.

        `off` (n,) is x − x_r in its unit, all else is scaled. It is the optimum of a relaxation that keeps every bound
        up to `_ACCURACY`, with multipliers that are not negative (`nearest_in`).
        """
        if not self._is_solvable:
            raise np.linalg.LinAlgError("the cost does not tell plans apart")
        (N, m), n, scales = (self.formulation.horizon, len(self.formulation.R)), len(off), self.formulation.scales
        drift = self._drift @ defects.ravel()
        rows, limits = self._rows, np.concatenate([start_slack, slack.states[:-1].ravel(), slack.inputs.ravel()])
        limits, q_d = limits - self._bounds @ drift, -self._basis_of_cost.T @ (self._cost @ drift)
        q, active, cuts, cut_limits = q_d, np.zeros(len(limits), bool), np.zeros((0, len(q_d))), np.zeros(0)
        for _ in range(_MOST_ROUNDS):
            plan = drift + self._basis @ q
            broken, cut = rows @ q > limits + _ACCURACY, self._cut(off - plan[:n] * scales.states)
            if cut is None and not np.any(broken):
                return plan[:n], plan[n : n + N * m].reshape(N, m)
            active |= broken
            if cut is not None:  # row · (off − e(0)) ≤ limit
                row, limit = cut[0] * scales.states, cut[1] - cut[0] @ off
                cuts = np.vstack([cuts, -row @ self._basis[:n]])
                cut_limits = np.append(cut_limits, limit + row @ drift[:n])
            found = nearest_in(np.vstack([rows[active], cuts]), np.append(limits[active], cut_limits), q_d)
            if found is None:
                return None
            q = found
        raise np.linalg.LinAlgError("too many half-spaces are needed")

    def _cut(self, error: Array) -> tuple[Array, float] | None:
        """Return a row (n,) and its support h_Z, 1 wide, that an error breaks by more than `_ACCURACY`; None in Z."""
        errors = self.nearest.errors
        if errors.halfspaces is not None:
            rows, limits = errors.halfspaces
            beyond = (rows @ error - limits) / self._widths
            at = int(np.argmax(beyond))
            row, limit, width = rows[at], limits[at], self._widths[at]
        else:
            inside = self.nearest(error)
            if inside is None:
                raise np.linalg.LinAlgError("the nearest error in Z is not found")
            row = self.nearest.normal(error, inside)
            limit, low = errors.support(np.vstack([row, -row]))
            width = limit + low + self._least(row)
        return (row / width, float(limit / width)) if row @ error - limit > _ACCURACY * width else None

    @cached_property
    def _widths(self) -> Array:
        """How wide Z is in the direction of each of its half-spaces; nearly zero where it is flat."""
        errors = self.nearest.errors
        rows, limits = errors.halfspaces or (np.zeros((0, errors.dimension)), np.zeros(0))
        return np.asarray(limits + errors.support(-rows) + self._least(rows))

    def _least(self, rows: Array) -> Array:
        return np.asarray(_FLAT * np.linalg.norm(rows * self.formulation.scales.states, axis=-1))

    @cached_property
    def _is_solvable(self) -> bool:
        """Whether the cost tells all plans apart in float64, so that there is one optimum."""
        return bool(self._triangular.size and np.linalg.cond(self._triangular) < _WORST_CONDITION)

    @cached_property
    def _basis(self) -> Array:
        """Plans p without defects that end on the reference."""
        return np.asarray(scipy.linalg.solve_triangular(self._triangular, self._ending.T, trans="T").T)

    @cached_property
    def _triangular(self) -> Array:
        return np.asarray(np.linalg.qr(self._cost @ self._ending, mode="r"))

    @cached_property
    def _ending(self) -> Array:
        """The same plans as orthonormal columns."""
        found = scipy.linalg.null_space(self._end)
        return np.vstack([found, np.zeros((self._cost.shape[1] - len(found), found.shape[1]))])

    @cached_property
    def _basis_of_cost(self) -> Array:
        """The orthonormal columns that the cost makes of the basis."""
        return np.asarray(self._cost @ self._basis)

    @cached_property
    def _rows(self) -> Array:
        return np.asarray(self._bounds @ self._basis)

    @cached_property
    def _drift(self) -> Array:
        """For each defect the smallest plan p that ends on the reference nevertheless."""
        free = self._model.drift
        return np.vstack([-np.linalg.pinv(self._end) @ free[-len(self.formulation.Q) :], np.eye(len(free))])

    @cached_property
    def _end(self) -> Array:
        """e(N) of e(0) and v, without defects."""
        n = len(self.formulation.Q)
        return np.hstack([self._model.free[-n:], self._model.forced[-n:]])

    @cached_property
    def _cost(self) -> Array:
        """The cost of p is ‖`_cost` p‖²."""
        Q, R = self.formulation.scaled_weights
        return self._each_step(square_root(Q), square_root(R))

    @cached_property
    def _bounds(self) -> Array:
        """`_bounds` p ≤ slack: the bounds of z(0), …, z(N − 1), then those of v, in parts of the widths."""
        X, U, scales = (
            self.formulation.inequalities.states,
            self.formulation.inequalities.inputs,
            self.formulation.scales,
        )
        return self._each_step(X.rows * scales.states / X.widths[:, None], U.rows * scales.inputs / U.widths[:, None])

    def _each_step(self, of_state: Array, of_input: Array) -> Array:
        """Return the matrix that makes of p the rows of e(0), …, e(N − 1), then those of v(0), …, v(N − 1)."""
        m, (N, n, _) = self._model, self._model.A.shape
        size = n + m.forced.shape[1] + N * n
        errors = np.vstack([np.eye(n, size), np.hstack([m.free, m.forced, m.drift])[:-n]])
        inputs = np.eye(m.forced.shape[1], size, n)
        return np.vstack([np.kron(np.eye(N), of_state) @ errors, np.kron(np.eye(N), of_input) @ inputs])

    @property
    def _model(self) -> ErrorModel:
        return self.formulation.linear_optimum.model
