"""The controller's convex programs: built once, with parameters for all that changes from step to step."""

from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from trackable.arrays import Array
from trackable.control.step.prediction import Prediction
from trackable.control.step.room import Room, Side
from trackable.systems.constrained import ConstrainedSystem

# Interior points from one start: the same answer to the same question, whatever was asked before. The tolerance is
# tighter than the solver's own (1e-8), since a cost of 1e-8 is an error of 1e-4; where float64 does not give that much,
# the next one is tried.
_SOLVER = cp.CLARABEL
_TOLERANCES = (1e-12, 1e-10, 1e-8)
_MAX_ITERATIONS = 50
_ANSWERS = (cp.OPTIMAL, cp.INFEASIBLE)


@dataclass(frozen=True, eq=False)
class Question:
    """Variables e (N + 1, n) and v (N, m), and the parameters of a step: start, model, gaps and room.

    The models A_i and B_i of all steps are stacked, (N n, n) and (N n, m).
    """

    e: cp.Variable
    v: cp.Variable
    start: cp.Parameter
    A: cp.Parameter
    B: cp.Parameter
    gaps: cp.Parameter
    room_of_states: cp.Parameter
    room_of_inputs: cp.Parameter

    @classmethod
    def about(cls, plant: ConstrainedSystem, horizon: int) -> "Question":
        n, m = len(plant.system.states), len(plant.system.inputs)
        return cls(
            e=cp.Variable((horizon + 1, n)),
            v=cp.Variable((horizon, m)),
            start=cp.Parameter(n),
            A=cp.Parameter((horizon * n, n)),
            B=cp.Parameter((horizon * n, m)),
            gaps=cp.Parameter((horizon, n)),
            room_of_states=cp.Parameter((horizon, 2 * len(plant.state_set.rows))),
            room_of_inputs=cp.Parameter((horizon, 2 * len(plant.input_set.rows))),
        )

    def dynamics(self) -> list[cp.Constraint]:
        """e(0) is where the system is, and e(i+1) = A_i e(i) + B_i v(i) + d_i."""
        n = self.start.size
        steps = [slice(i * n, (i + 1) * n) for i in range(self.v.shape[0])]
        return [
            self.e[0] == self.start,
            *(
                self.e[i + 1] == self.A[at] @ self.e[i] + self.B[at] @ self.v[i] + self.gaps[i]
                for i, at in enumerate(steps)
            ),
        ]

    def bounds(self, plant: ConstrainedSystem, wider: cp.Expression | float = 0.0) -> list[cp.Constraint]:
        """e and v in their room, each bound moved out by `wider` of its width."""
        kept = []
        for values, bounded, room in (
            (self.e[1:], plant.state_set, self.room_of_states),
            (self.v, plant.input_set, self.room_of_inputs),
        ):
            if len(bounded.rows):
                side = Side.of(bounded)
                kept.append(values @ side.rows.T <= room + wider * np.ones((room.shape[0], 1)) @ side.widths[None])
        return kept


@dataclass(frozen=True, eq=False)
class Program:
    """A problem in the variables of a question. ValueError where it would have to be built afresh for each step."""

    question: Question
    problem: cp.Problem

    def __post_init__(self) -> None:
        if not self.problem.is_dcp(dpp=True):
            raise ValueError("program: must be convex, and affine in its parameters")

    def plan(self, prediction: Prediction, start: Array, gaps: Array, room: Room) -> Array | None:
        """The optimal v (N, m); None where the solver found no solution, whatever it says why."""
        asked = self.question
        n, m = prediction.B.shape[1:]
        asked.A.value, asked.B.value = prediction.A.reshape(-1, n), prediction.B.reshape(-1, m)
        asked.start.value, asked.gaps.value = start, gaps
        asked.room_of_states.value, asked.room_of_inputs.value = room.states, room.inputs
        data, chain, inverse = self.problem.get_problem_data(_SOLVER, solver_opts={})
        for tolerance in _TOLERANCES:
            options = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), tolerance)
            options["max_iter"] = _MAX_ITERATIONS
            raw = chain.solve_via_data(self.problem, data, warm_start=False, verbose=False, solver_opts=options)
            solution = chain.invert(raw, inverse)
            if solution.status in _ANSWERS:
                break
        return np.asarray(solution.primal_vars[asked.v.id]) if solution.status == cp.OPTIMAL else None


def tracking(plant: ConstrainedSystem, horizon: int, Q: Array, R: Array) -> Program:
    """min Σ_(i<N) ‖e(i)‖²_Q + ‖v(i)‖²_R with e(N) = 0 and everything in its room."""
    q = Question.about(plant, horizon)
    cost = _squared(q.e[:-1], Q) + _squared(q.v, R)
    landing = q.e[horizon] == 0
    return Program(q, cp.Problem(cp.Minimize(cost), [*q.dynamics(), *q.bounds(plant), landing]))


def widening(plant: ConstrainedSystem, horizon: int) -> Program:
    """The least part of their widths by which all sets must grow (or may shrink) for a plan with e(N) = 0."""
    q = Question.about(plant, horizon)
    wider = cp.Variable()
    landing = q.e[horizon] == 0
    return Program(q, cp.Problem(cp.Minimize(wider), [*q.dynamics(), *q.bounds(plant, wider), landing]))


def closest(plant: ConstrainedSystem, horizon: int) -> Program:
    """min ‖e(N)‖ (Euclidean) with everything in its room."""
    q = Question.about(plant, horizon)
    return Program(q, cp.Problem(cp.Minimize(cp.sum_squares(q.e[horizon])), [*q.dynamics(), *q.bounds(plant)]))


def _squared(rows: cp.Expression, weight: Array) -> cp.Expression:
    """Σ_i ‖row_i‖² in the norm of `weight`."""
    return cp.quad_form(cp.vec(rows, order="C"), np.kron(np.eye(rows.shape[0]), weight), assume_PSD=True)
