"""The variables and parameters that all programs of a controller have in common."""

from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from trackably.arrays import Array
from trackably.control.step.error_model import ErrorModel
from trackably.control.step.scales import Scales
from trackably.control.step.slack import Inequalities, Slack
from trackably.systems.constrained import ConstrainedSystem


@dataclass(frozen=True, eq=False)
class StepVariables:
    """Variables e (N + 1, n) and v (N, m), and parameters for everything that changes from step to step.

    All are in the scales of the plant, and slack in parts of the widths, so that a solver meets numbers near one in
    whatever units the plant is given. The matrices A_i and B_i of all steps are stacked: (N n, n) and (N n, m).
    """

    e: cp.Variable
    v: cp.Variable
    initial_error: cp.Parameter
    terminal_error: cp.Parameter
    A: cp.Parameter
    B: cp.Parameter
    defects: cp.Parameter
    state_slack: cp.Parameter
    input_slack: cp.Parameter

    @classmethod
    def of(cls, plant: ConstrainedSystem, horizon: int) -> "StepVariables":
        n, m = len(plant.system.states), len(plant.system.inputs)
        return cls(
            e=cp.Variable((horizon + 1, n)),
            v=cp.Variable((horizon, m)),
            initial_error=cp.Parameter(n),
            terminal_error=cp.Parameter(n),
            A=cp.Parameter((horizon * n, n)),
            B=cp.Parameter((horizon * n, m)),
            defects=cp.Parameter((horizon, n)),
            state_slack=cp.Parameter((horizon, 2 * len(plant.state_set.rows))),
            input_slack=cp.Parameter((horizon, 2 * len(plant.input_set.rows))),
        )

    def assign(
        self, model: ErrorModel, initial_error: Array, defects: Array, slack: Slack, terminal_error: Array
    ) -> None:
        """Give the parameters their values, all scaled."""
        n, m = model.B.shape[1:]
        self.A.value, self.B.value = model.A.reshape(-1, n), model.B.reshape(-1, m)
        self.initial_error.value, self.defects.value = initial_error, defects
        self.state_slack.value, self.input_slack.value = slack.states, slack.inputs
        self.terminal_error.value = terminal_error

    def dynamics(self) -> list[cp.Constraint]:
        """Return the constraints e(0) = `initial_error` and e(i+1) = A_i e(i) + B_i v(i) + d_i."""
        n = self.initial_error.size
        steps = [slice(i * n, (i + 1) * n) for i in range(self.v.shape[0])]
        return [
            self.e[0] == self.initial_error,
            *(
                self.e[i + 1] == self.A[at] @ self.e[i] + self.B[at] @ self.v[i] + self.defects[i]
                for i, at in enumerate(steps)
            ),
        ]

    def ends(self) -> cp.Constraint:
        """Return the constraint e(N) = `terminal_error`."""
        return self.e[self.v.shape[0]] == self.terminal_error

    def bounds(
        self, plant: ConstrainedSystem, scales: Scales, widening: cp.Expression | float = 0.0
    ) -> list[cp.Constraint]:
        """Return the constraints that keep e and v within their slack, with each bound moved out by `widening` of its
        width."""
        constraints = []
        for values, polytope, scale, slack in (
            (self.e[1:], plant.state_set, scales.states, self.state_slack),
            (self.v, plant.input_set, scales.inputs, self.input_slack),
        ):
            if len(polytope.rows):
                given = Inequalities.of(polytope)
                rows = given.rows * scale / given.widths[:, None]
                constraints.append(values @ rows.T <= slack + widening * np.ones(slack.shape))
        return constraints
