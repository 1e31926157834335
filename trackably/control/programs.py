"""The convex programs of a step, as matrices for an interior-point method."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import clarabel
import numpy as np
import scipy
from scipy import sparse
from scipy.sparse.linalg import splu

from trackably.arrays import Array
from trackably.control.error_set import ErrorSet

# An interior-point method without warm start: the result depends on the numbers only, not on earlier steps. The first
# tolerance is tighter than the solver's default (1e-8), because a cost of 1e-8 is an error of 1e-4. If float64 does not
# allow this accuracy, the solver ends when it makes no more progress: its last point counts if the last tolerance is
# reached; otherwise the next tolerance is tried, with which the solver ends earlier.
_TOLERANCES = (1e-12, 1e-10, 1e-8)
_MAX_ITERATIONS = 50


Matrix = Array | sparse.csr_array | sparse.csc_array


@dataclass(frozen=True, eq=False)
class Program:
    """min ½ xᵀ P x + qᵀ x with E x = f and F x ≤ g, where A stacks E on F; P and A may be sparse.

    E has as many rows as there are `equations`.
    """

    P: Matrix
    q: Array
    A: Matrix
    equations: int

    def solve(self, limits: Array, tolerances: tuple[float, ...] = _TOLERANCES) -> Array | None:
        """Return the optimal x for `limits` (f, g); None if the solver finds none.

        Its accuracy is the first of the `tolerances` if float64 allows, and at least the last. Raises ArithmeticError
        if a number is not finite.
        """
        P, A = self._matrices
        if not (np.all(np.isfinite(limits)) and np.all(np.isfinite(A.data))):
            raise ArithmeticError("the step's quadratic program has numbers that are not finite: choose other units")
        sizes = (clarabel.ZeroConeT, self.equations), (clarabel.NonnegativeConeT, len(limits) - self.equations)
        cones = [cone(size) for cone, size in sizes if size]
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_iter = _MAX_ITERATIONS
        settings.max_threads = 1
        settings.reduced_tol_gap_abs = settings.reduced_tol_gap_rel = settings.reduced_tol_feas = tolerances[-1]
        for tolerance in tolerances:
            settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
            found = clarabel.DefaultSolver(P, self.q, A, limits, cones, settings).solve()
            if found.status in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
                return np.array(found.x)
            if found.status == clarabel.SolverStatus.PrimalInfeasible:
                return None
        return None

    def solve_equations(self, values: Array) -> Array:
        """Return the optimal x with E x = `values`, whatever F x is, up to rounding.

        An interior-point method finds the minimum of a quadratic cost only up to the square root of its accuracy: a
        cost of 1e-12 is an error of 1e-6. If no x satisfies the equations, or x is not unique, the result satisfies the
        optimality conditions in the sense of least squares, and is the smallest of such solutions.
        """
        return np.asarray(self._solved_conditions(np.concatenate([-self.q, values]))[: len(self.q)])

    @cached_property
    def _solved_conditions(self) -> Callable[[Array], Array]:
        """The map from (−q, f) to (x, y) with P x + Eᵀ y = −q and E x = f."""
        E = np.asarray(self.A[: self.equations])
        conditions = np.block([[np.asarray(self.P), E.T], [E, np.zeros((len(E), len(E)))]])
        try:
            return splu(sparse.csc_array(conditions)).solve
        except RuntimeError:  # splu found a pivot that is zero: equations depend on each other
            return scipy.linalg.pinvh(conditions).dot

    @cached_property
    def _matrices(self) -> tuple[sparse.csc_array, sparse.csc_array]:
        """The upper triangle of P, and A, as the solver takes them."""
        return sparse.triu(sparse.csc_array(self.P), format="csc"), sparse.csc_array(self.A)


@dataclass(frozen=True, eq=False)
class StepPrograms:
    """The programs of a step in z = (e(0), …, e(N), v(0), …, v(N − 1)), with e(i+1) = A_i e(i) + B_i v(i) + d_i.

    e = x − x_r is the error of the state and v = u − u_r that of the input, with `A` (N, n, n) and `B` (N, n, m). The
    defects d are given with each step. They contain the reference's own defects (zero up to rounding if u_r belongs to
    x_r) and the error of a linearisation.

    Plans start at e(0) = x − x_r − s with s in the set `start`, where x is the measured state. They have the cost
    zᵀ M z with M = `weights`, and the matrix `bounds` maps z to what the bounded quantities use of their widths.

    All are scaled, so that a solver works with numbers near one in whatever units the plant is given.
    """

    A: Array
    B: Array
    weights: Array
    bounds: Array
    start: ErrorSet

    @cached_property
    def dynamics(self) -> Array:
        """The matrix D (N n, (N + 1) n + N m) of A_i e(i) + B_i v(i) − e(i+1), with which the model reads D z = −d."""
        (N, n, m), i = self.B.shape, np.arange(len(self.B))
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

    @cached_property
    def tracking(self) -> Program:
        """min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R for a given e(N), where e and v keep the plant's bounds.

        With e(N) = 0 the plan ends on the reference.
        """
        return self._program(2 * self.weights)

    @cached_property
    def widening(self) -> Program:
        """Minimise t, where every bound moves out by t times its width so that a plan with a given e(N) exists.

        If the minimum is negative, all bounds may move in accordingly.
        """
        return self._program(0 * self.weights, widens=True)

    @cached_property
    def terminal_error(self) -> Program:
        """min ‖e(N)‖ (Euclidean, scaled) with e and v within their slack. Its e(N) is unique, its plan is not."""
        return self._program(2 * self._end.T @ self._end, ends=False)

    def _program(self, P: Array, ends: bool = True, widens: bool = False) -> Program:
        """Return a program in (e, v, p, t) with the cost ½ xᵀ `P` x of x = (e, v).

        The numbers p describe the error between the measured state and the plan's start, as in `ErrorSet`.
        If the program `ends` plans, e(N) is given. If it `widens` the sets, the number t is added to the cost, and
        each bound moves out by t times its width; otherwise there is no t.
        """
        start, (steps, count), used = self.start, self.dynamics.shape, len(self.bounds)
        n, h, q, each = len(start.centre), len(start.sums), len(start.lower), np.eye(len(start.lower))
        end = self._end if ends else self._end[:0]
        equations = n + h + steps + len(end)
        of_errors = [np.eye(n, count), np.zeros((h, count)), self.dynamics, end, np.zeros((2 * q, count)), self.bounds]
        of_start = [start.directions.T, start.sums, np.zeros((steps + len(end), q)), each, -each, np.zeros((used, q))]
        of_widening = [np.zeros((equations + 2 * q, int(widens))), np.full((used, int(widens)), -1.0)]
        return Program(
            scipy.linalg.block_diag(P, np.zeros((q + widens, q + widens))),
            np.append(np.zeros(count + q), np.ones(int(widens))),
            np.hstack([*map(np.vstack, (of_errors, of_start, of_widening))]),
            equations,
        )

    @property
    def _end(self) -> Array:
        """The matrix that maps z = (e(0), …, e(N), v(0), …, v(N − 1)) to the last error e(N)."""
        N, n, _ = self.B.shape
        return np.eye(len(self.weights))[N * n : (N + 1) * n]
