"""The tube controller: its optimum against a naive program, what is kept, and what it says where there is no plan."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.loops.disturbed import constant, drawn, greedy
from tests.trackably.control.instances import at_rest
from tests.trackably.control.tube import naive
from tests.trackably.control.tube.instances import LOOPS, STEPS, Loop
from tests.trackably.systems.disturbance.instances import CART, EXAMPLE1
from trackably.control.controller import Controller
from trackably.control.programs import StepPrograms
from trackably.control.simulation import shifted_inputs, simulate
from trackably.control.stepping import Infeasible, Plan, Status
from trackably.control.tube import TubeController, TubeProblem
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.tightening import tightening


def off(loop, part: float) -> np.ndarray:
    """A state beside the reference, by a part of the widths."""
    rng, widths = np.random.default_rng(3), 1 / np.sqrt(np.diag(loop.controller.Q))
    return loop.reference.state(0) + part * widths * rng.uniform(-1, 1, len(widths))


@pytest.mark.parametrize("name", LOOPS)
def test_inside_of_the_tube_the_plan_is_the_reference(name):
    loop = LOOPS[name]
    Z = loop.tightening.invariant
    edge = Z.disturbance.farthest(np.ones(len(Z.box)))
    plan = loop.controller.step(3, loop.reference.state(3) + edge, loop.reference)
    assert isinstance(plan, Plan)
    assert plan.cost < 1e-20
    assert plan.status is Status.NO_ACTIVE_BOUND
    np.testing.assert_allclose(plan.input, loop.reference.input(3) + Z.feedback @ edge, atol=1e-9)


@pytest.mark.parametrize("name", LOOPS)
@pytest.mark.parametrize("part", [0.05, 0.15])
def test_the_optimum_is_that_of_the_naive_program(name, part):
    loop = LOOPS[name]
    state = off(loop, part)
    plan, cost = (
        loop.controller.step(0, state, loop.reference),
        naive.optimum(loop.controller, 0, state, loop.reference),
    )
    if isinstance(plan, Plan):
        assert plan.cost == pytest.approx(cost, rel=1e-6, abs=1e-8)
        assert loop.controller.errors.contains((1 - 1e-6) * (state - plan.states[0]))
    else:
        assert isinstance(plan, Infeasible)
        assert cost == np.inf


def feasible_start(loop) -> np.ndarray:
    """Return a state off the tube from which there is a plan."""
    part = 0.3
    while not isinstance(loop.controller.step(0, off(loop, part), loop.reference), Plan):
        part /= 2
    return off(loop, part)


def kinds(loop) -> dict:
    W, n = loop.disturbance, len(loop.controller.Q)
    return {
        "drawn": drawn(W, 5),
        "greedy": greedy(W, loop.plant.state_set),
        "up": constant(W, np.ones(n)),
        "down": constant(W, -np.ones(n)),
    }


@pytest.mark.parametrize("name", LOOPS)
@pytest.mark.parametrize("kind", ["drawn", "greedy", "up", "down"])
def test_no_bound_is_broken_no_step_has_no_plan_and_the_cost_falls(name, kind):
    """From a state off the tube: V(k + 1) ≤ V(k) − ℓ(k) at each step, whatever the disturbances are."""
    loop = LOOPS[name]
    start = feasible_start(loop)
    run = simulate(loop.controller, loop.reference, start, STEPS, disturbances=kinds(loop)[kind])
    assert not run.without_plan
    assert np.min(loop.plant.state_set.margin(run.states[1:])) >= 0
    assert np.min(loop.plant.input_set.margin(run.inputs)) >= 0
    assert np.max(run.cost_increases) <= 1e-6 * (1e-3 + run.costs[0])
    assert run.costs[-1] < 1e-3 * run.costs[0]


def test_the_nominal_controller_loses_its_plan_under_the_same_disturbances():
    """On a reference that touches its bound a push towards it is too much; the tube controller's own leaves room."""
    loop = LOOPS["example1"]
    nominal = Controller(EXAMPLE1, 12, loop.controller.Q, loop.controller.R)
    touching = at_rest(EXAMPLE1, 0.05)
    run = simulate(nominal, touching, touching.state(0), STEPS, disturbances=constant(loop.disturbance, np.ones(1)))
    assert run.without_plan or np.min(EXAMPLE1.state_set.margin(run.states)) < 0


@pytest.mark.parametrize("name", ["example1", "pushed cart", "triangle", "three states, a hull"])
def test_where_there_is_no_plan_it_says_how_close_one_comes_to_the_reference(name):
    """The least ‖z(N) − x_r‖ in scales, by the naive program without its end."""
    loop = LOOPS[name]
    part = 0.05
    while isinstance(result := loop.controller.step(0, off(loop, part), loop.reference), Plan):
        part *= 1.3
    assert isinstance(result, Infeasible)
    scales = loop.controller.formulation.scales.states
    missed = naive.least_terminal_error(loop.controller, 0, off(loop, part), loop.reference, scales)
    if result.terminal_error is None:
        assert missed == np.inf
        assert "no plan that keeps them was found" in result.explanation
        return
    assert np.linalg.norm(result.terminal_error / scales) == pytest.approx(missed, rel=1e-2, abs=1e-5)
    assert "a plan that keeps them misses the reference by" in result.explanation


@pytest.mark.parametrize("name", ["example1", "pushed cart", "triangle"])
def test_where_the_solver_fails_the_last_plan_is_kept(name, monkeypatch):
    """It finds the first plan only: the others are that plan, shifted, which is one whatever the disturbances are."""
    loop = LOOPS[name]
    start = feasible_start(loop)
    monkeypatch.setattr(TubeProblem, "without_bounds", lambda _: None)
    solve, calls = StepPrograms.solve, iter([True])
    monkeypatch.setattr(StepPrograms, "solve", lambda *given: solve(*given) if next(calls, False) else None)
    statuses = []
    of = loop.controller.step
    told = lambda *given: statuses.append(result := of(*given)) or result  # noqa: E731
    controller = SimpleNamespace(step=told, plant=loop.plant, horizon=loop.controller.horizon)
    run = simulate(controller, loop.reference, start, STEPS, disturbances=kinds(loop)["greedy"])
    assert not run.without_plan
    assert {result.status for result in statuses[1:4]} == {Status.KEPT}
    assert np.min(loop.plant.state_set.margin(run.states[1:])) >= 0
    assert np.min(loop.plant.input_set.margin(run.inputs)) >= 0
    assert np.max(run.cost_increases) <= 1e-6 * (1e-3 + run.costs[0])


FAST = ConstrainedSystem(
    LinearSystem([[0.3, 0.1], [0.0, 0.2]], [[0.0], [1.0]], sampling_time=0.1),
    Polytope.box([-1.0, -1.0], [1.0, 1.0]),
    Polytope.box([-2.0], [2.0]),
)
"""It forgets its state in a few steps: after 40, nothing of a start is left in float64."""


@pytest.mark.parametrize("horizon", [2, 40])
def test_the_last_plan_is_kept_by_a_system_that_forgets_its_start(horizon):
    loop = Loop(FAST, Zonotope.box([-0.05, -0.05], [0.05, 0.05]), horizon=horizon)
    rng, state = np.random.default_rng(0), loop.reference.state(0)
    plan = loop.controller.step(0, state, loop.reference)
    for k in range(1, 9):
        state = FAST.system.successor(state, plan.input) + loop.disturbance.draw(rng)
        problem = TubeProblem.of(loop.controller.formulation, k, state, loop.reference.window(k, horizon))
        plan = problem.keep(shifted_inputs(plan, loop.reference))
        assert plan.status is Status.KEPT
        assert loop.controller.errors.contains((1 - 1e-6) * (state - plan.states[0]))
        assert plan.terminal_residual < 1e-6
        assert plan.slack > -1e-6


def test_without_disturbance_the_costs_are_those_of_the_nominal_controller():
    still = tightening(CART, Zonotope.box([0.0, 0.0], [0.0, 0.0]))
    loop = LOOPS["pushed cart"]
    tube = TubeController(still, 12, loop.controller.Q, loop.controller.R)
    nominal = Controller(CART, 12, loop.controller.Q, loop.controller.R)
    for part in (0.0, 0.02, 0.1):
        ours, theirs = (c.step(0, off(loop, part), loop.reference) for c in (tube, nominal))
        assert isinstance(ours, Plan)
        assert isinstance(theirs, Plan)
        assert ours.cost == pytest.approx(theirs.cost, rel=1e-6, abs=1e-12)
        np.testing.assert_allclose(ours.input, theirs.input, atol=1e-5)
