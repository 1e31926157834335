"""A convex program that is solved thousands of times: translated for the solver once, then only filled with numbers.

cvxpy needs several times as long as the solver to translate a program of some hundred variables, even where only the
values of parameters have changed. In the solver's form

    min ½ xᵀP x + qᵀx   subject to   A x + s = b,   s in zeros and non-negative numbers,

the entries of A and b are affine in the parameters. Keep that affine map, and apply it to each new set of values.
"""

from dataclasses import dataclass
from functools import cached_property

import clarabel
import cvxpy as cp
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from trackably.arrays import Array

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
    def _form(self) -> "_Form":
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
    def of(cls, problem: cp.Problem) -> "_Form":
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
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    return settings
