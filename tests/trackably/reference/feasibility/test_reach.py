"""Nonlinear systems: what cannot be reached is told before anything is learned; what is reached is never called so."""

import math

import numpy as np
import pytest

from trackably import (
    ConstrainedSystem,
    Impossible,
    NonlinearSystem,
    Polytope,
    pendulum,
    tank,
    two_tanks,
)
from trackably.certificates.claim import Written, as_claim
from trackably.checker.certificate import Window
from trackably.reference.feasibility import impossible
from trackably.reference.waypoints import Waypoints, waypoints

SEEDS = range(6)
TANK = tank(5.0)  # level + 2.5 (inflow − 0.6 √level)
STEP = 5.0


def plant(inflow: float, low: float = 0.1) -> ConstrainedSystem:
    return ConstrainedSystem(TANK, Polytope.box([low], [2.0]), Polytope.box([0.0], [inflow]))


def told(of: ConstrainedSystem, written: Written, at: Waypoints | None = None) -> Impossible | None:
    claim = as_claim(written)
    return impossible(of, claim, waypoints(at or {}, 1e-9, of, claim), [1.0] * of.signal_count)


def test_a_level_that_the_inflow_cannot_reach():
    """After two steps, at most what the largest level and inflow and the smallest outflow leave: boxes know no more."""
    found = told(plant(0.3), "all_times", {0.0: {"level": 0.2}, 10.0: {"level": 1.9}})
    first = 0.2 + 2.5 * (0.3 - 0.6 * math.sqrt(0.2))
    second = first + 2.5 * (0.3 - 0.6 * math.sqrt(first))
    assert found.given == "level = 1.9 at t = 10 s"
    assert found.missing == pytest.approx(1.9 - (first + 2.5 * (0.3 - 0.6 * math.sqrt(0.1))), rel=1e-3)
    assert found.missing <= 1.9 - second
    assert found.among == ("level = 0.2 at t = 0 s", "level in [0.1, 2]", "inflow in [0, 0.3]")
    assert told(plant(0.3), "all_times", {0.0: {"level": 0.2}, 10.0: {"level": second}}) is None


def test_a_window_in_which_the_tank_runs_empty():
    """The outflow is 0.6 √0.1 at least: what is left of 2 m is below 0.1 m in the sixth step."""
    found = told(plant(0.05), (0.0, 270.0))
    assert found.given == "level in [0.1, 2] at t = 30 s"
    assert "level in [0.1, 2] at t = 30 s is out of reach by at least 0.19" in found.explanation
    assert told(plant(0.05), (0.0, 24.0)) is None
    assert told(plant(0.05, low=0.0), (0.0, 270.0)) is None  # the root of zero may not be defined: nothing is known


def test_values_count_after_many_steps_in_which_nothing_changes():
    found = told(plant(0.6), "all_times", {100.0: {"level": 0.2}, 105.0: {"level": 1.9}, 500.0: {"level": 1.0}})
    assert found.given == "level = 1.9 at t = 105 s"
    assert told(plant(0.6), "all_times", {100.0: {"level": 0.2}, 105.0: {"level": 0.9}, 500.0: {"level": 1.0}}) is None
    assert told(plant(0.6), (0.0, 700.0), {5.0: {"level": 1.0}, 600.0: {"level": 0.2}, 605.0: {"level": 1.9}})


def test_of_free_states_nothing_is_known_until_a_value_is_given():
    system = NonlinearSystem.of(lambda x, u: [x[0] + u[0], x[0] * x[1] + u[1]], ("a", "b"), ("p", "q"), 1.0)
    free = ConstrainedSystem(system, Polytope.box([-1.0, -np.inf], [1.0, np.inf]), Polytope.box([0, 0], [0.1, 0.1]))

    def of(values: Waypoints) -> Impossible | None:
        return impossible(free, Window(0.0, 9.0), waypoints(values, 1e-9, free, Window(0.0, 9.0)), [0.0, 0.0])

    assert of({0.0: {"a": 0.5}, 1.0: {"b": 50.0}}) is None
    assert of({0.0: {"a": 0.5, "b": 2.0}, 1.0: {"b": 50.0}}).missing == pytest.approx(50.0 - 1.1)
    assert of({0.0: {"a": 0.5}, 1.0: {"b": 50.0}, 2.0: {"a": 0.8}}).given == "a = 0.8 at t = 2 s"


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("system", "start", "low", "high"),
    [(TANK, [1.0], 0.4, 1.0), (two_tanks(1.0), [1.0, 1.0], 0.2, 1.0), (pendulum(0.05), [0.0, 0.0], -1.0, 1.0)],
    ids=["tank", "two tanks", "pendulum"],
)
def test_what_a_trajectory_reaches_is_never_called_impossible(system, start, low, high, seed):
    rng = np.random.default_rng(seed)
    x, states, inputs = np.array(start), [], []
    for _ in range(12):
        u = rng.uniform(low, high, len(system.inputs))
        states.append(x)
        inputs.append(u)
        x = system.successor(x, u)
    X = Polytope.box(np.min(states, axis=0) - 1e-3, np.max(states, axis=0) + 1e-3)
    U = Polytope.box(np.min(inputs, axis=0) - 1e-3, np.max(inputs, axis=0) + 1e-3)
    of, h = ConstrainedSystem(system, X, U), system.sampling_time
    at = {h * k: dict(zip(system.states, states[k].tolist(), strict=True)) for k in range(12) if rng.random() < 0.5}
    assert told(of, (0.0, h * 11), at) is None


def test_small_entries_of_a_row_may_let_a_state_go_far():
    """The first state goes up to 101, as the second one may be 1e12: from 50 it can reach 55.

    Rows of several states say nothing of one of them; a value that is given does.
    """
    system = NonlinearSystem.of(lambda x, u: [x[0] + u[0], x[1] + u[1]], ("a", "b"), ("p", "q"), sampling_time=1.0)
    X = Polytope([[1.0, 1e-10], [0.0, 1.0]], [-1.0, -1e12], [1.0, 1e12])
    assert told(ConstrainedSystem(system, X, Polytope.box([5.0, -1e11], [10.0, 1e11])), (0.0, 1.0)) is None
    far = ConstrainedSystem(system, X, Polytope.box([205.0, -1e13], [210.0, 1e13]))
    assert told(far, (0.0, 1.0)) is None
    assert told(far, (0.0, 1.0), {0.0: {"a": -90.0}, 1.0: {"a": 90.0}}).missing == pytest.approx(25.0, rel=1e-6)
