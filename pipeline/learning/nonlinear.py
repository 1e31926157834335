"""One nonlinear program: SciPy's SLSQP on l(θ) with constraints at finitely many times, gradients exact, in ln θ."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import minimize

from pipeline.arrays import Array
from pipeline.gp.posterior import IllConditioned, Posterior
from pipeline.learning.problem import ConstrainedProblem

_TOLERANCE = 1e-13
_MAX_ITERATIONS = 200


class Program:
    """The problem with each constraint standing at given `times` only (one array for each constraint)."""

    def __init__(self, problem: ConstrainedProblem, times: tuple[Array, ...]):
        self.problem = problem
        self.times = times
        self._posterior_at = lru_cache(maxsize=4)(self._posterior)

    def minimise(self, start: Array) -> Array:
        """ln θ of a local minimum from `start`; where the solver ends short of one, wherever it ended."""
        constraint = {"type": "ineq", "fun": self.slack, "jac": self.slack_jacobian}
        return self._run(start, self.objective, [constraint] if any(t.size for t in self.times) else [])

    def minimise_violation(self, start: Array) -> Array:
        """ln θ of a local minimum of the largest violation from `start`: one more variable bounds it from above."""
        violation = float(-np.min(self.slack(start)))
        with_bound = np.append(start, violation)
        constraint = {
            "type": "ineq",
            "fun": lambda z: self.slack(z[:-1]) + z[-1],
            "jac": lambda z: np.column_stack([jacobian := self.slack_jacobian(z[:-1]), np.ones(len(jacobian))]),
        }
        last = np.eye(len(with_bound))[-1]
        return self._run(with_bound, lambda z: (float(z[-1]), last), [constraint])[:-1]

    def objective(self, log_theta: Array) -> tuple[float, Array]:
        try:
            return self._at(log_theta).negative_log_marginal_likelihood()
        except IllConditioned:  # a line search that sees +∞ turns back
            return np.inf, np.zeros_like(log_theta)

    def slack(self, log_theta: Array) -> Array:
        try:
            posterior = self._at(log_theta)
            return np.concatenate(
                [c.slack(posterior, t) for c, t in zip(self.problem.constraints, self.times, strict=True)]
            )
        except IllConditioned:
            return np.full(2 * sum(t.size for t in self.times), -1e6)

    def slack_jacobian(self, log_theta: Array) -> Array:
        try:
            posterior = self._at(log_theta)
            return np.concatenate(
                [c.slack_jacobian(posterior, t) for c, t in zip(self.problem.constraints, self.times, strict=True)]
            )
        except IllConditioned:
            return np.zeros((2 * sum(t.size for t in self.times), len(log_theta)))

    def _at(self, log_theta: Array) -> Posterior:
        # The optimiser asks for value, slack and Jacobian at one point in turn: all three share one factor.
        return self._posterior_at(log_theta.tobytes())

    def _posterior(self, key: bytes) -> Posterior:
        return self.problem.posterior(np.frombuffer(key))

    def _run(
        self, start: Array, objective: Callable[[Array], tuple[float, Array]], constraints: Sequence[Any]
    ) -> Array:
        space = self.problem.space
        free = [(None, None)] * (len(start) - len(space.log_lower))
        result = minimize(
            objective,
            start,
            jac=True,
            method="SLSQP",
            bounds=[*zip(space.log_lower, space.log_upper, strict=True), *free],
            constraints=constraints,
            options={"ftol": _TOLERANCE, "maxiter": _MAX_ITERATIONS},
        )
        return np.asarray(result.x)
