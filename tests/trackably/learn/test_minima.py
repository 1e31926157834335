"""The minima of the likelihood are searched once, before bounds: the search with bounds begins at them."""

import numpy as np
import pytest

from trackably import ConstrainedSystem, LinearSystem, Matern52, Periodic, Polytope, Samples, learn_reference
from trackably.gp.joint import JointPrior
from trackably.gp.prior import Prior
from trackably.learning.joint import search
from trackably.learning.joint.search import learn_jointly
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace

AXIS = ConstrainedSystem(
    LinearSystem.discretised([[0, 1], [0, 0]], [[0], [1]], 0.05, states=["position", "velocity"], inputs=["force"]),
    Polytope.box([-1.2, -0.9], [0.4, 0.9]),
    Polytope.box([-1.5], [1.5]),
)
TIMES = np.linspace(0, 8, 30)
SWUNG = Samples(TIMES, -0.4 + 0.6 * np.sin(2 * np.pi * TIMES / 4) + 0.02 * np.random.default_rng(0).normal(size=30))


@pytest.mark.parametrize(
    ("kernel", "claim"), [(Matern52(), "recorded"), (Periodic(), "all_phases")], ids=["Matérn 5/2", "periodic"]
)
def test_what_is_learned_is_what_a_second_search_finds(monkeypatch, kernel, claim):
    searched = []

    def counted(problem, *others, **options):
        searched.append(problem)
        return best(problem, *others, **options)

    best, known = search.best_solution, search.learn_jointly
    monkeypatch.setattr(search, "best_solution", counted)
    found = learn_reference(SWUNG, AXIS, kernel, claim, starts=2, progress=False)
    assert not [problem for problem in searched if not problem.constraints]
    monkeypatch.setattr("trackably.learn.learn_jointly", lambda problem, also, minima: known(problem, also))
    anew = learn_reference(SWUNG, AXIS, kernel, claim, starts=2, progress=False)
    assert [problem for problem in searched if not problem.constraints]
    assert found.objective == pytest.approx(anew.objective, abs=1e-3)
    assert found.hyperparameters == pytest.approx(anew.hyperparameters, rel=1e-2)


def test_minima_without_all_hyperparameters_are_no_start():
    prior = JointPrior((Prior(Matern52(), mean=-0.4),))
    problem = ConstrainedProblem((SWUNG,), prior, SearchSpace.around((SWUNG,), prior, 2))
    some = [dict.fromkeys(prior.learned[:-1], 0.0)]
    assert learn_jointly(problem, minima=some).objective == learn_jointly(problem).objective
