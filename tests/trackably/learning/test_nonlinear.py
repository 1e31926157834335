"""One nonlinear program: what it tells the solver is true, and what the solver returns is a minimum."""

import numpy as np
import pytest

from pipeline.published.scalar import interval_sets, state_and_input
from tests.trackably.gp.instances import over
from tests.trackably.learning.instances import SEEDS, instance
from tests.trackably.systems.instances import PLANTS
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
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

SAMPLES = Samples(np.linspace(0, 2, 12), np.cos(3 * np.linspace(0, 2, 12)))
TIMES = (np.array([0.1, 0.9, 1.7]), np.array([0.3, 1.1]))


def program_of(kernel, plant=PLANTS["unstable"], backoff=1e-9, times=TIMES) -> Program:
    prior = JointPrior((Prior(kernel, 0.2, mean=0.1).as_learned(),))
    constraints = tuple(Constraint(q, Steps(0, 50, plant.sampling_time), backoff) for q in state_and_input(plant))
    return Program(ConstrainedProblem((SAMPLES,), prior, SearchSpace.around((SAMPLES,), prior), constraints), times)


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


@over(PLANTS, "plant")
def test_slack_is_the_distance_to_each_bound_as_a_part_of_the_width_less_the_backoff(plant):
    program = program_of(SquaredExponential(0.8, 0.5), plant, backoff=0.01)
    here = program.problem.prior.log_hyperparameters
    posterior = program.problem.posterior(here)
    x, u = (q(posterior.signals, times) for q, times in zip(state_and_input(plant), TIMES, strict=True))
    X, U = interval_sets(plant)
    expected = [(x - X.lower) / X.width, (X.upper - x) / X.width, (u - U.lower) / U.width, (U.upper - u) / U.width]
    at = program.evaluate(here)
    np.testing.assert_allclose(at.slack, np.concatenate(expected) - 0.01, atol=1e-12)
    assert at.jacobian.shape == (10, 3)


def test_a_hopeless_matrix_has_no_value():
    samples = Samples(np.arange(40) / 40, np.ones(40))
    prior = JointPrior((Prior(SquaredExponential(1.0, 1000.0).as_learned(), 1e-12),))
    problem = ConstrainedProblem((samples,), prior, SearchSpace.around((samples,), prior))
    assert Program(problem, ()).evaluate(prior.log_hyperparameters) is None
    box = SearchSpace({"signal_std": Interval(0.5, 2.0), "lengthscale": Interval(100.0, 2000.0)})
    hopeless = Program(ConstrainedProblem((samples,), prior, box), ())
    assert hopeless.minimise(prior.log_hyperparameters) is None
    assert hopeless.minimise_violation(prior.log_hyperparameters) is None


@pytest.mark.parametrize("seed", SEEDS)
def test_minimum_satisfies_the_first_order_conditions(seed):
    """Without constraints: no slope along any free direction."""
    problem = instance(seed).problem
    program = Program(problem, (np.empty(0), np.empty(0)))
    for start in problem.space.start_points()[:3]:
        found = program.minimise(start).x
        at = program.evaluate(found)
        free = (found > problem.space.log_lower + 1e-9) & (found < problem.space.log_upper - 1e-9)
        assert np.all(np.abs(at.gradient[free]) < 1e-3)
        assert at.value <= program.evaluate(start).value


@pytest.mark.parametrize("seed", SEEDS)
def test_minimising_the_violation_lowers_it(seed):
    problem = instance(seed).problem
    program = Program(problem, (np.linspace(0, 2, 21), np.linspace(0, 1.9, 20)))
    for start in problem.space.start_points()[:3]:
        found = program.minimise_violation(start).x
        assert program.evaluate(found).violation <= program.evaluate(start).violation + 1e-12
        assert np.all((found >= problem.space.log_lower - 1e-12) & (found <= problem.space.log_upper + 1e-12))
