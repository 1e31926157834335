"""The same problems as one would write them down without this library: every constraint on the grid, at every step.

Hyperparameters are ln θ, bounds drawn in as the library does; what breaks a bound by less than 1e-7 of its width is
feasible. Derivatives are finite differences for SciPy, and exact ones, of second order too, for CasADi.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import NonlinearConstraint, minimize

from benchmarks.problems import Example
from pipeline.published.scalar import coefficients, interval_sets
from trackably.arrays import Array
from trackably.gp.kernels.periodic import Periodic
from trackably.learning.constraint import ROUNDING_BACKOFF

_FEASIBLE = -1e-7


@dataclass(frozen=True)
class OnGrid:
    """States at the steps up to `last`, and the inputs that lead there, as plain formulas of ln θ."""

    example: Example
    last: int

    @property
    def is_periodic(self) -> bool:
        return isinstance(self.example.prior.parts[0].kernel, Periodic)

    @property
    def noise(self) -> float:
        return self.example.prior.parts[0].noise_std

    @property
    def steps(self) -> Array:
        return np.arange(self.last + 1) * self.example.system.sampling_time

    def kernel(self, log_theta: Any, r: Any, exp: Any = np.exp, sin: Any = np.sin) -> Any:
        """κ(r), for floats and for symbols."""
        variance, scale = exp(2 * log_theta[0]), exp(-2 * log_theta[1])
        if self.is_periodic:
            return variance * exp(-2 * scale * sin(np.pi * r * exp(-log_theta[2])) ** 2)
        return variance * exp(-scale / 2 * r**2)

    def margins(self, mean: Any, concatenate: Any = np.concatenate) -> Any:
        """Relative margins at all steps, from the posterior mean there."""
        a, b, c = coefficients(self.example.system)
        inputs = (mean[1:] - a * mean[:-1] - c) / b
        sides = []
        for values, bounds in zip((mean, inputs), interval_sets(self.example.system), strict=True):
            sides += [(values - bounds.lower) / bounds.width, (bounds.upper - values) / bounds.width]
        return concatenate(sides)

    def objective(self, log_theta: Array) -> float:
        """l(θ); 1e10 where there is none."""
        try:
            value, _ = self._solved(log_theta)
        except LinAlgError:
            return 1e10
        return value

    def slack(self, log_theta: Array) -> Array:
        """What must not be negative."""
        times = self.example.samples.times
        try:
            _, weights = self._solved(log_theta)
        except LinAlgError:
            return np.full(4 * self.last + 2, -1.0)
        mean = self.kernel(log_theta, self.steps[:, None] - times) @ weights
        return np.asarray(self.margins(mean) - ROUNDING_BACKOFF)

    def _solved(self, log_theta: Array) -> tuple[float, Array]:
        samples = self.example.samples
        gram = self.kernel(log_theta, samples.times[:, None] - samples.times)
        factor = cho_factor(gram + self.noise**2 * np.eye(len(samples)), lower=True, check_finite=False)
        weights = cho_solve(factor, samples.values, check_finite=False)
        determinant = 2 * np.sum(np.log(np.diag(factor[0])))
        return float(determinant + samples.values @ weights + len(samples) * np.log(2 * np.pi)), weights

    @property
    def box(self) -> list[tuple[float, float]]:
        space = self.example.space
        return list(zip(space.log_lower.tolist(), space.log_upper.tolist(), strict=True))

    def best(self, ends: Iterable[Array]) -> tuple[float, Array]:
        """l and ln θ of the best feasible of some points."""
        kept = [(self.objective(x), x) for x in ends if np.min(self.slack(x)) >= _FEASIBLE]
        return min(kept, key=lambda found: found[0], default=(np.inf, np.empty(0)))


def by_slsqp(problem: OnGrid, starts: Iterable[Array]) -> tuple[float, Array]:
    """SLSQP, with finite differences."""
    constraint = {"type": "ineq", "fun": problem.slack}
    with np.errstate(all="ignore"):
        ends = [
            minimize(
                problem.objective,
                start,
                method="SLSQP",
                bounds=problem.box,
                constraints=constraint,
                options={"ftol": 1e-10, "maxiter": 200},
            ).x
            for start in starts
        ]
        return problem.best(ends)


def by_trust_constr(problem: OnGrid, starts: Iterable[Array]) -> tuple[float, Array]:
    """trust-constr, with finite differences."""
    constraint = NonlinearConstraint(problem.slack, 0.0, np.inf)
    with np.errstate(all="ignore"):
        ends = [
            minimize(
                problem.objective,
                start,
                method="trust-constr",
                bounds=problem.box,
                constraints=constraint,
                options={"gtol": 1e-6, "xtol": 1e-9, "maxiter": 1000},
            ).x
            for start in starts
        ]
        return problem.best(ends)


def by_ipopt(problem: OnGrid, starts: Iterable[Array]) -> tuple[float, Array]:
    """CasADi's IPOPT with exact second derivatives; built anew at each call."""
    solver = ipopt(problem)
    return problem.best(solver(start) for start in starts)


def ipopt(problem: OnGrid) -> Callable[[Array], Array]:
    """The program, built: ln θ at the end from ln θ at the start."""
    import casadi as ca

    samples, space = problem.example.samples, problem.example.space
    log_theta = ca.SX.sym("log_theta", len(space.log_lower))
    parts = [log_theta[i] for i in range(log_theta.numel())]
    gram = problem.kernel(parts, ca.SX(samples.times[:, None] - samples.times), ca.exp, ca.sin)
    factor = ca.chol(gram + problem.noise**2 * ca.SX.eye(len(samples))).T  # lower triangle
    half = ca.solve(factor, ca.SX(samples.values))
    objective = 2 * ca.sum1(ca.log(ca.diag(factor))) + ca.sumsqr(half) + len(samples) * np.log(2 * np.pi)
    weights = ca.solve(factor.T, half)
    mean = problem.kernel(parts, ca.SX(problem.steps[:, None] - samples.times), ca.exp, ca.sin) @ weights
    slack = problem.margins(mean, lambda sides: ca.vertcat(*sides)) - ROUNDING_BACKOFF
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-9, "max_iter": 500}}
    solver = ca.nlpsol("fit", "ipopt", {"x": log_theta, "f": objective, "g": slack}, options)

    def solved(start: Array) -> Array:
        found = solver(x0=start, lbx=space.log_lower, ubx=space.log_upper, lbg=0.0, ubg=np.inf)
        return np.asarray(found["x"]).ravel()

    return solved
