"""The convex programs of a controller, translated for the solver once, and filled with numbers in each step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import clarabel
import cvxpy as cp
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from trackably.arrays import Array
from trackably.control.bounds import Inequalities, PlantInequalities, Scales, Slack
from trackably.control.error_model import ErrorModel
from trackably.systems.constrained import ConstrainedSystem

# An interior-point method without warm start: the result depends on the parameters only, not on earlier steps. The
# first tolerance is tighter than the solver's default (1e-8), because a cost of 1e-8 is an error of 1e-4. The next
# tolerance is tried where float64 does not reach it.
_TOLERANCES = (1e-12, 1e-10, 1e-8)
_MAX_ITERATIONS = 50


@dataclass(frozen=True, eq=False)
class CompiledProgram:
    """A quadratic or linear program with parameters in its constraints alone.

    ValueError where it is not convex and affine in its parameters, or where its objective has parameters.
    """

    problem: cp.Problem

    def __post_init__(self) -> None:
        if not self.problem.is_dcp(dpp=True):
            raise ValueError("program: must be convex, and affine in its parameters")
        if self.problem.objective.parameters():
            raise ValueError("program: must have no parameters in its objective")

    def solve(self) -> dict[int, Array] | None:
        """Return the optimal values of the variables, by their ids, for the present values of the parameters.

        None where the solver finds no solution. Raises ArithmeticError where a parameter is not finite.
        """
        form = self._form
        A, b = form.constraints_at(self._values())
        for tolerance in _TOLERANCES:
            found = clarabel.DefaultSolver(form.P, form.q, A, b, form.cones, _settings(tolerance)).solve()
            if found.status == clarabel.SolverStatus.Solved:
                return form.split(np.array(found.x))
            if found.status == clarabel.SolverStatus.PrimalInfeasible:
                return None
        return None

    def _values(self) -> Array:
        """Return all parameters in the order of the form, and a one."""
        values = np.ones(self._form.parameters)
        for parameter in self.problem.parameters():
            first = self._form.first_parameter[parameter.id]
            values[first : first + parameter.size] = np.ravel(parameter.value, order="F")
        if not np.all(np.isfinite(values)):
            raise ArithmeticError("the numbers of its program are not finite")
        return values

    @cached_property
    def _form(self) -> _Form:
        return _Form.of(self.problem)


@dataclass(frozen=True, eq=False)
class _Form:
    """The solver's form: entries of −A and b are `entries` times (parameters, 1); all else is constant.

    Column by column, with b as the last one, entry i lies in row `rows[i]`; column j begins at entry `columns[j]`.
    Variables and parameters are vectors of all their entries, each in the order of Fortran, by id.
    """

    P: sparse.csc_array
    q: Array
    cones: list[object]
    entries: sparse.csr_array
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    height: int
    first_parameter: dict[int, int]
    variables: dict[int, tuple[int, tuple[int, ...]]]

    @classmethod
    def of(cls, problem: cp.Problem) -> _Form:
        data, _, _ = problem.get_problem_data(cp.CLARABEL, solver_opts={})
        program, dims, q = data[cp.settings.PARAM_PROB], data["dims"], data["c"]
        height, size = dims.zero + dims.nonneg, len(q)
        assert program.constr_size == height, "only equations and inequalities"
        tensor = sparse.csr_array(program.A)
        used = np.flatnonzero(np.diff(tensor.indptr))
        return cls(
            P=sparse.triu(data.get("P", sparse.csc_array((size, size)))).tocsc(),
            q=q,
            cones=[
                cone(count)
                for cone, count in ((clarabel.ZeroConeT, dims.zero), (clarabel.NonnegativeConeT, dims.nonneg))
                if count
            ],
            entries=tensor[used],
            rows=used % height,
            columns=np.searchsorted(used // height, np.arange(size + 2)),
            height=height,
            first_parameter=program.param_id_to_col,
            variables={v.id: (program.var_id_to_col[v.id], v.shape) for v in program.variables},
        )

    @property
    def parameters(self) -> int:
        """How many numbers parameters have, and the one that constants are multiplied with."""
        return int(self.entries.shape[1])

    def constraints_at(self, values: Array) -> tuple[sparse.csc_array, Array]:
        """Return A and b for the values of the parameters."""
        found, begin = self.entries @ values, self.columns[-2]
        b = np.zeros(self.height)
        b[self.rows[begin:]] = found[begin:]
        shape = (self.height, len(self.q))
        return sparse.csc_array((-found[:begin], self.rows[:begin], self.columns[:-1]), shape=shape), b

    def split(self, x: Array) -> dict[int, Array]:
        """Return the variables of which x (all of them) is made."""
        return {
            name: x[first : first + int(np.prod(shape))].reshape(shape, order="F")
            for name, (first, shape) in self.variables.items()
        }


def _settings(tolerance: float) -> clarabel.DefaultSettings:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = _MAX_ITERATIONS
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    return settings


class Start(Protocol):
    """What a program says of e(0) = (x(0) − x_r) / scales."""

    def constraints(self, start: cp.Expression, widening: cp.Expression | float) -> list[cp.Constraint]:
        """Return the constraints on the scaled e(0) (n,), bounds moved out by `widening` of their widths."""
        ...

    def assign(self, off: Array, slack: Array) -> None:
        """Give the parameters their values, for x − x_r = `off` (n,) and the slack of x_r itself (2r,)."""
        ...


@dataclass(frozen=True, eq=False)
class MeasuredStart:
    """e(0) is what is measured. It is not bounded, because no input changes it any more."""

    scales: Scales

    @cached_property
    def parameter(self) -> cp.Parameter:
        return cp.Parameter(len(self.scales.states))

    def constraints(self, start: cp.Expression, _: cp.Expression | float) -> list[cp.Constraint]:
        return [start == self.parameter]

    def assign(self, off: Array, _: Array) -> None:
        self.parameter.value = off / self.scales.states


class _Symbols(NamedTuple):
    """Variables, and parameters in the order of their definition."""

    e: cp.Variable
    v: cp.Variable
    A: cp.Parameter
    B: cp.Parameter
    defects: cp.Parameter
    end: cp.Parameter
    state_slack: cp.Parameter
    input_slack: cp.Parameter


@dataclass(frozen=True, eq=False)
class StepPrograms:
    """The programs in e(0), …, e(N) and v(0), …, v(N − 1), with parameters for all that changes from step to step.

    All are in the scales of the plant, and slack in parts of the widths, so that a solver meets numbers near one in
    whatever units the plant is given. `weights` Q and R are scaled, too. The matrices A_i and B_i of all steps are
    stacked: (N n, n) and (N n, m).
    """

    plant: ConstrainedSystem
    horizon: int
    scales: Scales
    weights: tuple[Array, Array]
    start: Start

    @cached_property
    def tracking(self) -> CompiledProgram:
        """min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R with e(N) as given (0: on the reference), e and v within their slack."""
        (Q, R), s = self.weights, self._symbols
        return self._compiled(_squared(s.e[:-1], Q) + _squared(s.v, R))

    @cached_property
    def widening(self) -> CompiledProgram:
        """The least part of their widths by which all sets must grow, or the most they may shrink, for an e(N)."""
        by = cp.Variable()
        return self._compiled(by, by)

    @cached_property
    def terminal_error(self) -> CompiledProgram:
        """min ‖e(N)‖ (Euclidean, in scales) with e, v within their slack: e(N) is unique then, the plan is not."""
        return self._compiled(cp.sum_squares(self._symbols.e[self.horizon]), ends=False)

    def solve(
        self,
        program: CompiledProgram,
        model: ErrorModel,
        off: Array,
        defects: Array,
        slack: Slack,
        start_slack: Array,
        end: Array | float = 0.0,
    ) -> tuple[Array, Array] | None:
        """Return the optimal e(0) (n,) and v (N, m) of one of the programs; None where the solver finds no solution.

        `model` is scaled; `off` = x − x_r (n,), `defects` (N, n), `end` = e(N) and what is returned are in their units.
        `start_slack` (2r,) is that of x_r. Raises ArithmeticError where a number is not finite.
        """
        states, inputs, s = self.scales.states, self.scales.inputs, self._symbols
        self.start.assign(off, start_slack)
        s.A.value, s.B.value = np.concatenate([*model.A]), np.concatenate([*model.B])
        s.defects.value, s.end.value = defects / states, np.broadcast_to(end, off.shape) / states
        s.state_slack.value, s.input_slack.value = slack.states, slack.inputs
        found = program.solve()
        return None if found is None else (found[s.e.id][0] * states, found[s.v.id] * inputs)

    def _compiled(
        self, cost: cp.Expression, widening: cp.Expression | float = 0.0, ends: bool = True
    ) -> CompiledProgram:
        """Return a program with the dynamics, and with each bound moved out by `widening` of its width."""
        s, n = self._symbols, len(self.plant.system.states)
        constraints = self.start.constraints(s.e[0], widening)
        for i in range(self.horizon):
            at = slice(i * n, (i + 1) * n)
            constraints.append(s.e[i + 1] == s.A[at] @ s.e[i] + s.B[at] @ s.v[i] + s.defects[i])
        for values, polytope, scale, slack in (
            (s.e[1:], self.plant.state_set, self.scales.states, s.state_slack),
            (s.v, self.plant.input_set, self.scales.inputs, s.input_slack),
        ):
            if len(polytope.rows):
                rows = Inequalities.of(polytope).in_widths(scale)
                constraints.append(values @ rows.T <= slack + widening * np.ones(slack.shape))
        if ends:
            constraints.append(s.e[self.horizon] == s.end)
        return CompiledProgram(cp.Problem(cp.Minimize(cost), constraints))

    @cached_property
    def _symbols(self) -> _Symbols:
        N, n, m = self.horizon, len(self.plant.system.states), len(self.plant.system.inputs)
        return _Symbols(
            cp.Variable((N + 1, n)),
            cp.Variable((N, m)),
            *(cp.Parameter(shape) for shape in ((N * n, n), (N * n, m), (N, n), (n,))),
            *(cp.Parameter((N, 2 * len(of.rows))) for of in (self.plant.state_set, self.plant.input_set)),
        )


def _squared(rows: cp.Expression, weight: Array) -> cp.Expression:
    """Return Σ_i ‖row_i‖² in the norm of `weight`."""
    return cp.quad_form(cp.vec(rows, order="C"), np.kron(np.eye(rows.shape[0]), weight), assume_PSD=True)


_ELASTIC_TOLERANCE = 1e-10
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
    def least_change(self) -> Change:
        """The least change, in the Euclidean norm, after which no dynamics are missed, to first order; bounds are not
        kept."""
        return self.change(-np.linalg.lstsq(self.dynamics.toarray(), self.defects.ravel())[0])

    def change(self, x: Array) -> Change:
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
        found = clarabel.DefaultSolver(
            2 * half.tocsc(), linear, rows, limits, cone, _settings(_ELASTIC_TOLERANCE)
        ).solve()
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
                    sparse.kron(sparse.eye_array(self.horizon - 1), X.in_widths(self.scales.states)),
                    sparse.kron(sparse.eye_array(self.horizon), U.in_widths(self.scales.inputs)),
                ]
            )
        )

    @cached_property
    def _weights(self) -> sparse.csc_array:
        """V of inner states and inputs as a matrix."""
        inner, inputs = sparse.eye_array(self.horizon - 1), sparse.eye_array(self.horizon)
        return sparse.csc_array(sparse.block_diag([sparse.kron(inner, self.Q), sparse.kron(inputs, self.R)]))


def _joined(states: Array, inputs: Array) -> Array:
    return np.concatenate([states.ravel(), inputs.ravel()])
