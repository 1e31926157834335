"""After a budget the best that is proved is handed out; what is said of its J is true; enough time changes nothing.

The clock of these tests counts pieces of work.
"""

from dataclasses import replace
from functools import partial
from itertools import count

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES
from trackably import (
    ConstrainedSystem,
    NotTrackableError,
    Periodic,
    Polytope,
    Samples,
    SquaredExponential,
    TrackableReference,
    learn_reference,
    mobile_robot,
)
from trackably.certificates.outcome import Unproved
from trackably.certificates.prove import prove
from trackably.checker.certificate import Instants
from trackably.checker.watch import tick
from trackably.gp.signal import KernelSum
from trackably.learning.joint.dual import nonnegative_minimum
from trackably.learning.problem import OutOfTime
from trackably.learning.sqp import QuadraticProgram
from trackably.systems.reference import Reference
from trackably.work import BudgetEnded, until

SLOW = replace(AXIS, state_set=Polytope.box([-1.1, -0.9], [0.2, 0.9]))
pytestmark = pytest.mark.filterwarnings("ignore::trackably.IgnoresSamplesWarning")

LEARN = partial(learn_reference, SAMPLES, SLOW, SquaredExponential(), (0.0, 3.0), noise_std=0.02, starts=2)


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the clock say how often it was asked."""
    pieces = count()
    for module in ("trackably.reference.learn", "trackably.work"):
        monkeypatch.setattr(f"{module}.monotonic", lambda: float(next(pieces)))


def within(task: partial[TrackableReference], budget: float) -> TrackableReference | OutOfTime:
    try:
        return task(budget=budget)
    except NotTrackableError as error:
        why = error.outcome
    assert isinstance(why, OutOfTime)
    assert f"the budget of {budget:g} s ended before a reference was proved" in why.explanation
    return why


@pytest.mark.usefixtures("counted")
def test_what_is_handed_out_is_proved_and_not_farther_from_the_best_than_said():
    best = LEARN()
    assert "budget" not in best.explanation
    last, unfinished = np.inf, 0
    for budget in (1, 600, 1e9):
        found = within(LEARN, budget)
        if isinstance(found, OutOfTime):
            assert last == np.inf, "more time, and nothing any more"
            continue
        assert found.objective <= last + 1e-6 * (1 + abs(last))
        assert best.objective >= found.objective - found.price - 1e-6
        assert (f"the budget of {budget:g} s ended the search" in found.explanation) is (found.fit.budget is not None)
        last, unfinished = found.objective, unfinished + (found.fit.budget is not None)
    assert unfinished
    assert found.fit.budget is None
    assert found.objective == pytest.approx(best.objective, rel=1e-5)


SIGNAL, ONE = KernelSum(SquaredExponential(0.1, 0.5), 0.0, np.arange(9.0), np.ones(9)), np.eye(1)
PROGRAM = QuadraticProgram.of(ONE, ONE[0], ONE, -ONE[0], ONE[0], np.zeros((2, 4), bool))
LONG = {
    "values at many times": lambda: SIGNAL(np.zeros(10**5)),
    "a dual program": lambda: nonnegative_minimum(np.eye(2), np.ones(2)),
    "a quadratic program": lambda: PROGRAM.solve(ONE[0], 1.0),
    "the checker's arithmetic": lambda: prove(Reference((SIGNAL,), AXIS), Instants()),
}


@pytest.mark.parametrize("work", LONG.values(), ids=LONG)
def test_a_budget_ends_long_work_within_it(work, monkeypatch):
    monkeypatch.setattr("trackably.certificates.prove.judge", lambda outcome: outcome)
    with until(0.0), pytest.raises(BudgetEnded):
        work()


def test_a_proof_that_would_need_too_much_memory_within_a_budget_is_none(monkeypatch):
    monkeypatch.setitem(tick.__globals__, "MEMORY", -1)
    with until(1e9):
        assert isinstance(prove(Reference((SIGNAL,), AXIS), Instants()), Unproved)


@pytest.mark.usefixtures("counted")
def test_a_robot_whose_likeliest_hyperparameters_break_its_bounds_has_a_good_reference_soon():
    t, noise = np.arange(24) / 2, 0.03 * np.random.default_rng(0).standard_normal((2, 24))
    eight = {
        "x": Samples(t, 2 * np.sin(np.pi * t / 6) + noise[0]),
        "y": Samples(t, 1.2 * np.sin(np.pi * t / 3) + noise[1]),
    }
    inside = Polytope.box([-1.9, -1.1, -np.inf], [1.9, 1.1, np.inf])
    robot = ConstrainedSystem(mobile_robot(0.1), inside, Polytope.box([0.3, -1.6], [1.5, 1.6]))
    known = {"noise_std": 0.03, "mean": 0.0, "starts": 2}
    found = within(partial(learn_reference, eight, robot, Periodic(period=12.0), "all_phases", **known), 3000)
    assert isinstance(found, TrackableReference)
    assert found.objective < 200  # with the likeliest hyperparameters without bounds it is 1750
