"""Learning with a proof: the same optimum as Algorithm 1's sound reading, and a stronger claim."""

from dataclasses import replace
from itertools import pairwise

import pytest

import trackably.certificates.certified as module
from tests.trackably.certificates.references import PROBLEMS, certified
from tests.trackably.systems.instances import bounded
from trackably.certificates.certificate import Certificate
from trackably.certificates.certified import Attempt, Certified, learn_certified
from trackably.certificates.goal import Goal, for_all_times
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.checker.certificate import Window
from trackably.learning.learner import HYPERPARAMETERS, JOINT
from trackably.learning.problem import NothingFactored, NothingFeasible, RequiredValue
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


def test_given_values_have_no_second_choice():
    lost = replace(JOINT, solve=lambda problem: NothingFactored(problem.prior))
    one = RequiredValue("state", PLANT.quantities[0].trajectory, 0.0, -0.5, 1e-3)
    assert isinstance(learned(learner=lost, required=(one,)), NothingFactored)


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


def test_hyperparameters_alone_that_a_back_off_made_worse_are_not_the_answer():
    """As where no function is found: bounds are tightened by more than hyperparameters alone would need."""

    def without_function(problem):
        found = HYPERPARAMETERS.solve(problem)
        return replace(found, alone=found.objective)

    lost = replace(JOINT, solve=without_function, first_backoff=1e-3)
    found = learned(learner=lost)
    assert isinstance(found, Certified)
    assert found.solution.objective == certified("example1").solution.objective


@pytest.mark.parametrize("violation", [1e-5, 1e-4])
def test_the_next_back_off_removes_what_breaks_a_bound(violation):
    """Bounds are tightened by half of the back-off. Doubling it alone would take a dozen proofs."""
    attempts = []

    def prove(reference):
        outcome = GOAL.prove(reference)
        if attempts or not isinstance(outcome, Certificate):
            return outcome
        return Counterexample("state", BOUNDS, 0.1, violation * BOUNDS.width, reference, Window(0.0, 1.0))

    found = learned(goal=replace(GOAL, prove=prove), on_attempt=attempts.append, learner=JOINT)
    assert isinstance(found, Certified)
    first, second, *_ = attempts
    assert not first.proved
    assert second.backoff >= first.backoff + 2 * violation


def test_a_bound_that_rounding_keeps_from_being_proved_is_tightened_alone(monkeypatch):
    """A larger back-off of all bounds would not tighten it, as long as its own is larger still."""
    attempts = list[Attempt]()

    def prove(reference):
        outcome = GOAL.prove(reference)
        return outcome if len(attempts) > 2 else Unproved("state", BOUNDS, (0.1, 0.2), 0.0, "planted")

    monkeypatch.setattr(module, "_relative_errors", lambda reference: {"state": 1e-4})
    found = learned(goal=replace(GOAL, prove=prove), on_attempt=attempts.append, learner=JOINT)
    assert isinstance(found, Certified)
    assert [attempt.backoff for attempt in attempts] == [JOINT.first_backoff] * 4
    assert found.backoff == 4 * module._ROOM * 1e-4


def test_a_function_that_float64_cannot_evaluate_leaves_all_length_scales_to_its_second_choice(monkeypatch):
    """Shorter and shorter ones are tried for the function, until hyperparameters alone cost less in the given space."""
    limits, alone, errors = [], [], module._relative_errors

    def solve(learner, seen):
        def solved(problem):
            seen.append(problem.space.bounds["lengthscale"].upper)
            return learner.solve(problem)

        return replace(learner, solve=solved)

    def prove(reference):
        outcome = GOAL.prove(reference)
        return outcome if alone else Counterexample("state", BOUNDS, 0.1, 1e-3, reference, Window(0.0, 1.0))

    def planted(reference):
        return errors(reference) if alone else dict.fromkeys(errors(reference), 0.9 / (1 + len(limits)))

    monkeypatch.setattr(module, "_relative_errors", planted)
    learner = replace(solve(JOINT, limits), fallback=solve(HYPERPARAMETERS, alone))
    found = learned(goal=replace(GOAL, prove=prove), learner=learner)
    assert isinstance(found, Certified)
    assert found.solution.objective == certified("example1").solution.objective
    assert found.space == SPACE
    assert 1 < len(limits) < 10
    assert limits[0] == alone[0] == SPACE.bounds["lengthscale"].upper
    assert all(shorter < longer for longer, shorter in pairwise(limits))


def test_attempts_end_where_errors_leave_room_at_no_back_off(monkeypatch):
    """Errors of evaluation grow from attempt to attempt, but bounds are not drawn in any further."""
    attempts, unproved = [], Unproved("state", BOUNDS, (0.1, 0.1), 1e-4, "planted")

    def growing(_):
        return {q.name: 3e-3 * 1.01 ** len(attempts) for q in PLANT.quantities}

    monkeypatch.setattr(module, "_relative_errors", growing)
    goal = replace(GOAL, prove=lambda reference: unproved)
    learner = replace(JOINT, fallback=None)
    assert learned(goal=goal, on_attempt=attempts.append, learner=learner) is unproved
    assert len(attempts) < 10


@pytest.mark.parametrize(("failed_at", "span"), [(9.0, (3.5, 20.0)), (5.0, (0.0, 20.0)), (30.0, (10.0, 40.0))])
def test_constraints_reach_beyond_a_time_at_which_a_proof_fails(failed_at, span):
    """Before the window and after it, by half of its distance from the other end; never before zero."""
    goal = Goal(Window(10.0, 20.0), lambda reference: None, is_extensible=True)
    assert goal.longer(failed_at).times == Window(*span)
    assert not any(goal.longer(inside) for inside in (10.0, 15.0, 20.0))


def test_constraints_are_extended_to_where_a_proof_failed_before_them():
    moved = tuple(replace(of, times=of.times + 16.0) for of in SAMPLES)
    goal, windows = for_all_times(moved, PRIOR, PLANT), list[Window]()

    def prove(reference):
        failed = Unproved("state", BOUNDS, (2.0, 2.5), 0.0, "planted")
        return goal.prove(reference) if windows else failed

    def extended(solution, problem):
        windows.append(problem.constraints[0].index_set.of)
        return JOINT.extended(solution, problem)

    assert goal.times.start > 2.5
    learner = replace(JOINT, extended=extended)
    assert isinstance(
        learn_certified(moved, PRIOR, PLANT, SPACE, replace(goal, prove=prove), learner=learner), Certified
    )
    assert windows == [Window(0.0, goal.times.end)]
