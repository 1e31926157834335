"""The tube controller: its optimum against a naive program, and what is kept."""

import numpy as np
import pytest

from pipeline.loops.disturbed import disturbed_plant
from tests.trackably.control import naive
from tests.trackably.control.tube.instances import LOOPS, STEPS, Loop
from trackably.control.simulation import simulate
from trackably.control.stepping import Infeasible, Plan, Status
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope


def off(loop, part: float) -> np.ndarray:
    """A state beside the reference, by a part of the widths."""
    rng, widths = np.random.default_rng(3), 1 / np.sqrt(np.diag(loop.controller.Q))
    return loop.reference.state(0) + part * widths * rng.uniform(-1, 1, len(widths))


@pytest.mark.parametrize("name", LOOPS)
@pytest.mark.parametrize("part", [0.05, 0.15])
def test_the_optimum_is_that_of_the_naive_program(name, part):
    loop = LOOPS[name]
    state = off(loop, part)
    plan = loop.controller.step(0, state, loop.reference)
    cost = naive.tube_optimum(loop.controller, 0, state, loop.reference)
    if isinstance(plan, Plan):
        assert plan.cost == pytest.approx(cost, rel=1e-6, abs=1e-8)
        assert loop.controller.errors.contains((1 - 1e-6) * (state - plan.states[0]))
    else:
        assert isinstance(plan, Infeasible)
        assert cost == np.inf


def feasible_start(loop) -> np.ndarray:
    """Return a state off the tube from which there is a plan."""
    part = 0.3
    while not isinstance(loop.controller.step(0, start := off(loop, part), loop.reference), Plan):
        part /= 2
    return start


def pushes(loop, kind):
    """Return the disturbance of a kind, or the one that is always farthest in a direction."""
    if isinstance(kind, str):
        return disturbed_plant(kind, loop.tightening, 5)[1]
    point = loop.disturbance.farthest(kind * np.ones(len(loop.controller.Q)))
    return lambda k, successor: point


RUNS = [*((name, "greedy") for name in LOOPS), *(("triangle", kind) for kind in ("drawn", 1, -1))]


@pytest.mark.parametrize(("name", "kind"), RUNS)
def test_no_bound_is_broken_no_step_has_no_plan_and_the_cost_falls(name, kind):
    """From a state off the tube: V(k + 1) ≤ V(k) − ℓ(k) at each step, whatever the disturbances are."""
    loop = LOOPS[name]
    start = feasible_start(loop)
    run = simulate(loop.controller, loop.reference, start, STEPS, disturbances=pushes(loop, kind))
    assert not run.without_plan
    assert np.min(loop.plant.state_set.margin(run.states[1:])) >= 0
    assert np.min(loop.plant.input_set.margin(run.inputs)) >= 0
    assert np.max(run.cost_increases) <= 1e-6 * (1e-3 + run.costs[0])
    assert run.costs[-1] < 1e-3 * run.costs[0]


FAST = ConstrainedSystem(
    LinearSystem([[0.3, 0.1], [0.0, 0.2]], [[0.0], [1.0]], sampling_time=0.1),
    Polytope.box([-1.0, -1.0], [1.0, 1.0]),
    Polytope.box([-2.0], [2.0]),
)
"""It forgets its state in a few steps: after 40, nothing of a start is left in float64."""


@pytest.mark.parametrize("horizon", [2, 40])
def test_a_system_that_forgets_its_start_has_a_plan_at_each_step(horizon):
    """From a state off the tube, and the cost falls."""
    loop = Loop(FAST, Zonotope.box([-0.05, -0.05], [0.05, 0.05]), horizon=horizon)
    rng, state = np.random.default_rng(0), feasible_start(loop)
    plan = loop.controller.step(0, state, loop.reference)
    assert plan.status is Status.SOLVED
    for k in range(1, 9):
        state, before = FAST.system.successor(state, plan.input) + loop.disturbance.draw(rng), plan
        plan = loop.controller.step(k, state, loop.reference)
        assert loop.controller.errors.contains((1 - 1e-6) * (state - plan.states[0]))
        assert plan.cost <= before.cost - before.stage_cost + 1e-8
        assert plan.terminal_residual < 1e-6
        assert plan.slack > -1e-6


def test_a_state_outside_of_its_bounds_has_no_plan_even_if_there_is_no_disturbance():
    loop = Loop(FAST, Zonotope.box([0.0, 0.0], [0.0, 0.0]))
    assert isinstance(loop.controller.step(0, [0.9, 0.0], loop.reference), Plan)
    assert loop.controller.step(0, [1.02, 0.0], loop.reference).excess == pytest.approx(0.02, rel=1e-3)
