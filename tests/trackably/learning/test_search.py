"""The search that suits the kernels: periods are looked for, however few starts are asked for."""

import numpy as np
import pytest

from trackably.gp.joint import JointPrior
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.exchange import Exchange
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.screening import screen
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace

TIMES, PERIOD = np.arange(0, 8, 0.15), 1.1
COURSES = (
    0.8 * np.sin(2 * np.pi * TIMES / PERIOD),
    0.5 * np.cos(2 * np.pi * TIMES / PERIOD) + 0.2 * np.sin(4 * np.pi * TIMES / PERIOD),
)


def problem(noise_std: float, *samples: Samples) -> ConstrainedProblem:
    """Signals of one period, and a single start; no constraints."""
    parts = (Prior(Periodic(1.0, 1.0, 1.0).as_learned(), noise_std),) * len(samples)
    names = ("q1", "q2")[: len(samples)]
    prior = JointPrior(parts, names, frozenset({"period"}))
    return ConstrainedProblem(samples, prior, SearchSpace.around(samples, prior, starts=1))


def test_the_period_of_two_signals_is_found_though_a_single_start_misses_it():
    """Every multiple of the period is a minimum too, and that is where the single start ends."""
    rng = np.random.default_rng(0)
    asked = problem(0.02, *(Samples(TIMES, course + 0.02 * rng.standard_normal(TIMES.size)) for course in COURSES))
    found, single = best_solution(asked), Exchange(asked)
    single.together(asked.space.start_points())
    alone = single.outcome
    assert isinstance(found, Solution)
    assert found.posterior.prior.hyperparameters["period"] == pytest.approx(PERIOD, abs=0.01)
    assert isinstance(alone, Solution)
    assert alone.objective > found.objective + 10


def test_of_many_samples_some_show_the_period():
    times = np.linspace(0, 8, 2000)
    values = np.sin(2 * np.pi * times / PERIOD) + 0.1 * np.random.default_rng(0).standard_normal(2000)
    assert np.exp(screen(problem(0.1, Samples(times, values)), 4)[0])[2] == pytest.approx(PERIOD, abs=0.05)
