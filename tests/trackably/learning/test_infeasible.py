"""Where nothing keeps the bounds, or nothing can be evaluated, the answer says so in true numbers."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from pipeline.published.scalar import scalar
from tests.trackably.gp.instances import over
from tests.trackably.learning import naive
from tests.trackably.learning.instances import Instance, instance
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.problem import ConstrainedProblem, NothingFeasible, Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.systems.intervals import Interval

# The prior mean 0 is no admissible equilibrium, and the samples are no help: by the quantity that breaks its bounds.
PRIOR, TIMES = Prior(SquaredExponential(1.0, 1.0).as_learned(), 0.1), [0.0, 0.2, 0.4, 0.6, 0.8]
FAR = scalar(0.9, 0.5, state_set=Interval(1.0, 2.0), input_set=Interval(-5.0, 5.0), sampling_time=0.05)
DRIFTING = scalar(1.0, -1.0, 1.0, state_set=Interval(-9.0, 9.0), input_set=Interval(-0.5, 0.4), sampling_time=0.05)
STATE, INPUT = [-9.0, -11.0, -10.0, -10.5, -9.5], [0.3, 0.1, 0.2, 0.15, 0.1]
INFEASIBLE = {
    "state": (Instance(Samples(TIMES, STATE), PRIOR, FAR, 60), "state", 0.0),
    "input": (Instance(Samples(TIMES, INPUT), PRIOR, DRIFTING, 60), "input", 1.0),
}


@over(INFEASIBLE, "case", "quantity", "at_rest")
def test_an_infeasible_problem_is_explained_in_true_numbers_and_no_point_of_a_grid_violates_less(
    case, quantity, at_rest
):
    answer, space = best_solution(case.problem), case.problem.space
    assert isinstance(answer, NothingFeasible)
    bounds = answer.quantity.bounds
    assert answer.quantity.name == quantity
    x, u = naive.states_and_inputs(case, answer.best.prior.parts[0])
    margins = bounds.margin(x if quantity == "state" else u)
    assert answer.violation == pytest.approx(-np.min(margins), abs=1e-9)
    assert margins[round(answer.time / 0.05)] == pytest.approx(np.min(margins), abs=1e-9)
    assert f"breaks the {quantity} bounds {bounds} at t = {answer.time:.6g} s by" in answer.explanation
    assert answer.explanation.startswith(
        f"the prior mean 0 is no admissible equilibrium (its {quantity} {at_rest:.4g} does not lie inside {bounds})"
    )
    for log_theta in product(*np.linspace(space.log_lower, space.log_upper, 25).T):
        margins = naive.margins(case, naive.prior_at(case, log_theta))
        assert np.min(margins) <= -answer.violation / bounds.width + 1e-3


def test_a_search_that_can_factor_nothing_is_explained():
    """Noise far too small for so many samples so close: no start has a Cholesky factor."""
    samples = Samples(np.arange(30) / 100, np.sin(np.arange(30) / 100))
    prior = Prior(SquaredExponential(1.0, 0.2).as_learned(), 1e-12)
    case = replace(instance(0), samples=samples, prior=prior)
    space = SearchSpace({"signal_std": Interval(0.5, 2.0), "lengthscale": Interval(5.0, 50.0)})
    for constraints in (case.problem.constraints, ()):
        answer = best_solution(ConstrainedProblem((samples,), JointPrior((prior,)), space, constraints))
        assert not isinstance(answer, Solution)
        assert "positive definite" in answer.explanation
