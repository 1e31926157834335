"""The law of disturbed loops: no bound is broken, and no step is without a plan."""

from copy import copy
from fractions import Fraction
from functools import cache

import numpy as np
import pytest

from benchmarks.disturbed import Case, disturbed_runs, random_case
from pipeline.loops import disturbed as loops
from pipeline.loops.disturbed import many_runs
from tests.trackably.systems.disturbance.instances import scaled

SEEDS = (0, 3, 11, 12)


@cache
def case_of(seed: int) -> Case:
    return random_case(seed, 40)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_bound_is_broken_and_no_step_is_without_a_plan(seed):
    found = disturbed_runs(case_of(seed), 120)
    assert found["steps"] >= 120
    assert (found["steps_outside"], found["steps_without_plan"]) == (0, 0)


def test_a_controller_that_leaves_no_room_is_counted(monkeypatch):
    """Disturbances that are thirty times too large break bounds, and the counts tell."""
    case = case_of(11)
    pushed = case.tightening.invariant.disturbance.farthest(np.ones(1))
    as_modelled = case.tightening.given.linear.successor
    plant = (lambda k, x, u: as_modelled(x, u), lambda k, x: 30 * pushed)
    monkeypatch.setattr(loops, "disturbed_plant", lambda kind, tightened, seed: plant)
    found = disturbed_runs(case, 1)
    assert found["steps_outside"] + found["steps_without_plan"] > 0


def test_runs_of_the_tube_break_nothing_and_too_large_disturbances_are_counted():
    case = case_of(11)
    wide = copy(case.tightening)  # with the set of errors of the smaller disturbances
    object.__setattr__(wide, "disturbance", scaled(case.tightening.disturbance, Fraction(30)))
    window = case.robust.window(0, 40)
    broken = [many_runs(tightened, window, 0)[1] for tightened in (case.tightening, wide)]
    assert broken[0] == 0 < broken[1]
