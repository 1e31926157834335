"""Learning with a proof: the same optimum as Algorithm 1's sound reading, and a stronger claim."""

from dataclasses import replace

import pytest

from tests.trackably.certificates.references import PROBLEMS, certified
from tests.trackably.systems.instances import bounded
from trackably.certificates import certified as learning
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.goal import for_all_times
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.prove import prove
from trackably.checker.certificate import Window
from trackably.learning.learner import JOINT
from trackably.learning.problem import NothingFactored, NothingFeasible
from trackably.systems.intervals import Interval

SAMPLES, PRIOR, PLANT, SPACE = PROBLEMS["example1"]
GOAL, BOUNDS = for_all_times(SAMPLES, PRIOR, PLANT), PLANT.quantities[0].bounds


def learned(**options):
    return learn_certified(SAMPLES, PRIOR, PLANT, SPACE, **options)


def test_example1_has_the_sound_optimum():
    found = certified("example1")
    theta = found.solution.posterior.prior.hyperparameters
    assert theta["signal_std"] == pytest.approx(0.701178, abs=3e-5)
    assert theta["lengthscale"] == pytest.approx(0.219672, abs=3e-6)
    assert found.solution.objective == pytest.approx(-3.716033, abs=1e-5)


def test_a_problem_without_solution_has_none():
    impossible = bounded(PLANT, state_set=Interval(0.5, 1.0))
    assert isinstance(learn_certified(SAMPLES, PRIOR, impossible, SPACE), NothingFeasible | Counterexample | Unproved)


def test_a_learner_that_finds_nothing_is_followed_by_its_second_choice():
    lost = replace(JOINT, solve=lambda problem: NothingFactored(problem.prior))
    found = learned(learner=lost)
    assert isinstance(found, Certified)
    assert found.solution.method == "hyperparameters"
    assert found.solution.objective == certified("example1").solution.objective


@pytest.mark.parametrize(("by", "kept"), [(10.0, "hyperparameters"), (-10.0, "joint")])
def test_a_function_that_a_back_off_made_worse_than_hyperparameters_alone_is_not_the_answer(by, kept):
    """As if it had been found with J larger or smaller by ten, and hyperparameters alone with twenty less."""

    def moved(problem):
        found = JOINT.solve(problem)
        return replace(found, objective=found.objective + by, alone=found.objective + by - 20)

    found = learned(learner=replace(JOINT, solve=moved))
    assert isinstance(found, Certified)
    assert found.solution.method == kept
    assert found.solution.objective <= certified("example1").solution.objective


def test_constraints_are_extended_to_where_a_proof_failed_before_them(monkeypatch):
    moved = tuple(replace(of, times=of.times + 16.0) for of in SAMPLES)
    goal, windows = for_all_times(moved, PRIOR, PLANT), list[Window]()

    def planted(*problem):
        return prove(*problem) if windows else Unproved("state", BOUNDS, (2.0, 2.5), 0.0, "planted")

    def extended(solution, problem):
        windows.append(problem.constraints[0].index_set.of)
        return JOINT.extended(solution, problem)

    assert goal.times.start > 2.5
    monkeypatch.setattr(learning, "prove", planted)
    learner = replace(JOINT, extended=extended)
    assert isinstance(learn_certified(moved, PRIOR, PLANT, SPACE, goal, learner=learner), Certified)
    assert windows == [Window(0.0, goal.times.end)]
