"""One nonlinear program: what it tells the solver is true."""

import numpy as np
import pytest

from trackably.gp.joint import JointPrior
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import Steps
from trackably.learning.nonlinear import Program
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

SAMPLES = Samples(np.linspace(0, 2, 12), np.cos(3 * np.linspace(0, 2, 12)))


def by_central_differences(f, x, step=1e-5):
    columns = [(f(x + step * e) - f(x - step * e)) / (2 * step) for e in np.eye(x.size)]
    return np.stack(columns, axis=-1)


TWO_AXES = ConstrainedSystem(
    LinearSystem(
        np.array([[1.0, 0.1, 0.0, 0.0], [0.0, 1.0, 0.0, 0.2], [0.0, 0.0, 1.0, 0.1], [0.0, 0.0, 0.0, 0.9]]),
        np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.0], [0.02, 0.1]]),
        np.array([0.0, 0.01, 0.0, 0.0]),
        sampling_time=0.1,
    ),
    Polytope(np.array([[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, -1.0]]), -np.ones(2), 2 * np.ones(2)),
    Polytope.box(np.array([-3.0, -np.inf]), np.array([2.0, np.inf])),
)


@pytest.mark.parametrize("shared", [frozenset(), frozenset({"lengthscale"}), frozenset({"lengthscale", "noise_std"})])
def test_gradients_of_several_signals_against_central_differences(shared):
    """Rows that look at both signals, and at one; hyperparameters of their own, and shared ones."""
    parts = (
        Prior(SquaredExponential(1.0, 0.5), 0.2, 0.1).as_learned(),
        Prior(Matern52(0.7, 0.5), 0.2, -0.2).as_learned(),
    )
    prior = JointPrior(parts, ("x", "y"), shared)
    _, seen = TWO_AXES.flatness.states[0].stencil
    samples = (SAMPLES, Samples(np.linspace(0, 1, 5), np.sin(np.arange(5)), [1, 2, 1, 0.5, 1], seen))
    constraints = tuple(Constraint(q, Steps(0, 20, 0.1)) for q in TWO_AXES.quantities)
    assert [len(q.functional.rounded) for q in TWO_AXES.quantities] == [2, 2, 2]
    problem = ConstrainedProblem(samples, prior, SearchSpace.around(samples, prior), constraints)
    program = Program(problem, (np.array([0.1, 0.9, 1.7]), np.array([0.3]), np.array([0.0, 1.1])))
    here = prior.log_hyperparameters
    at = program.evaluate(here)
    slopes = by_central_differences(lambda z: program.evaluate(z).slack, here)
    np.testing.assert_allclose(at.jacobian, slopes, rtol=1e-5, atol=1e-5 * (1 + np.max(np.abs(slopes))))
    slope = by_central_differences(lambda z: np.array(program.evaluate(z).value), here)
    np.testing.assert_allclose(at.gradient, slope, rtol=1e-5, atol=1e-5)
    posterior, bounds = problem.posterior(here), TWO_AXES.quantities[0].bounds
    signals = tuple(part.mean for part in posterior.parts)
    lower = (TWO_AXES.quantities[0](signals, np.array([0.1, 0.9, 1.7])) - bounds.lower) / bounds.width - 1e-9
    np.testing.assert_allclose(at.slack[:3], lower, atol=1e-12)
