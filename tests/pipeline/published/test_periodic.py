"""Periodic references on Example 2: four ways to constrain the same samples, and what each of them is worth."""

import numpy as np
import pytest

from pipeline.published.periodic import GrowthRates, all_phases, on_grid, on_intervals
from pipeline.published.scalar import coefficients, interval_sets
from tests.pipeline.command import few_periods
from tests.pipeline.published.periodic_instances import instance
from tests.trackably.certificates.references import PLANT as SYSTEM
from tests.trackably.certificates.references import SAMPLES
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.prior import Prior
from trackably.learning import search
from trackably.learning.constraint import closest
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.space import SearchSpace

STATE_SET, INPUT_SET = interval_sets(SYSTEM)
SINGLE = Prior(Periodic(1.0, 1.0, 3.0).as_learned(), 0.1)
PRIOR = JointPrior((SINGLE,))
SPACE = SearchSpace.around((SAMPLES,), PRIOR, starts=6)

CONSTRAINTS = {
    "unconstrained": (),
    "grid": on_grid(SYSTEM, last_step=400),
    "exact": all_phases(SYSTEM, backoff=1e-7),
    **{f"intervals {n}": on_intervals(SYSTEM, 400, n) for n in (8, 32)},  # program (8)
}


@pytest.fixture(scope="module")
@few_periods
def found() -> dict[str, Solution]:
    of = {name: ConstrainedProblem((SAMPLES,), PRIOR, SPACE, chosen) for name, chosen in CONSTRAINTS.items()}
    return {name: search.best_solution(problem) for name, problem in of.items()}


def least_margin(outcome: Solution) -> float:
    """The smallest margin of state and input at equally spaced phases."""
    t = np.arange(20_000) / 20_000 * outcome.posterior.prior.hyperparameters["period"]
    (mean,) = outcome.posterior.signals
    x, after = mean(t), mean(t + 0.01)
    u = (after - 0.9 * x) / 0.1
    return float(min(np.min(STATE_SET.margin(x)), np.min(INPUT_SET.margin(u))))


def test_what_is_constrained_more_costs_more_and_only_the_exact_form_needs_no_more_than_all_phases(found):
    wanted = ("unconstrained", "grid", "exact", "intervals 32", "intervals 8")
    costs = [found[name].objective for name in wanted]
    assert costs == sorted(costs)
    kept = {name: least_margin(found[name]) for name in wanted}
    assert min(kept[name] for name in wanted[2:]) >= 0
    assert kept["unconstrained"] == pytest.approx(-0.2974, abs=1e-4)
    assert kept["grid"] == pytest.approx(-4.57e-4, abs=1e-5)
    x = found["grid"].posterior.signals[0](np.arange(4000) * 0.01)
    at_instants = INPUT_SET.margin((x[1:] - 0.9 * x[:-1]) / 0.1)
    assert np.min(at_instants[:400]) >= 0 > np.min(at_instants), "a later instant meets a phase that the grid has not"


@pytest.mark.parametrize("seed", range(5))
def test_the_worst_pair_is_the_worst_of_a_dense_grid_of_pairs(seed):
    """Also for systems with a > 1, b < 0 or a < 0."""
    case = instance(seed)
    posterior, (_, inputs) = JointPosterior(case.prior, case.samples), interval_sets(case.plant)
    (signal,) = posterior.signals
    (a, b, _), t_s = coefficients(case.plant), case.plant.sampling_time
    _, constraint = on_intervals(case.plant, round(2 / t_s), 4)
    dense = []
    for start in (0.0, 0.5, 1.0, 1.5):
        t = np.linspace(start, start + 0.5, 500)
        values = (t_s * signal.derivative(t)[:, None] + (1 - a) * signal(t)) / b
        dense.append(np.min(inputs.margin(values)) / inputs.width)
    ((places, found),) = closest([constraint], posterior)
    assert places.shape == (8, 2)
    assert -1e-3 <= np.min(found) - min(dense) <= 1e-12
    assert np.all((places >= 0) & (places <= 2))


def test_gradients_of_pairs_against_central_differences():
    case = instance(3)
    rates = GrowthRates(case.plant, (0.0, 1.0, 2.0))
    places = np.array([[0.1, 0.7], [1.2, 1.9], [0.0, 0.0]])
    theta = case.prior.log_hyperparameters

    def at(log_theta: np.ndarray) -> np.ndarray:
        moved = case.prior.with_log_hyperparameters(log_theta)
        return rates.value(*JointPosterior(moved, case.samples).signals, places)

    value, gradient = rates.value_and_gradient(JointPosterior(case.prior, case.samples), places)
    np.testing.assert_allclose(value, at(theta), rtol=1e-12)
    differences = [(at(theta + h) - at(theta - h)) / 2e-5 for h in 1e-5 * np.eye(3)]
    np.testing.assert_allclose(gradient, differences, rtol=1e-6, atol=1e-7)
