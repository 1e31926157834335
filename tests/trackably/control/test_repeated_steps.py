"""A step is taken over from the step before only where nothing differs: loops are the same, to the last bit."""

from dataclasses import dataclass, fields

import numpy as np
import pytest

from tests.trackably.control.instances import at_rest, double_integrator
from tests.trackably.control.test_nonlinear import CASES
from trackably.control.controller import Controller
from trackably.control.simulation import RepeatedSteps, apply_fallback, simulate
from trackably.systems.reference import Reference, Window

LINEAR = double_integrator()
LOOPS = {
    "linear": (Controller(LINEAR, 10, np.eye(2), np.eye(1)), at_rest(LINEAR, 0.2), np.array([0.2, 0.0])),
    "nonlinear": (CASES["tank"][0], at_rest(CASES["tank"][0].plant, 0.8), np.array([0.85])),
    "infeasible": (Controller(LINEAR, 10, np.eye(2), np.eye(1)), at_rest(LINEAR, 1.4), np.array([1.0, 0.0])),
}
STEPS = 300


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The steps at which a controller is asked."""
    asked: list[int] = []
    step = Controller.step
    monkeypatch.setattr(Controller, "step", lambda self, k, *rest: (asked.append(k), step(self, k, *rest))[1])
    return asked


@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_is_that_of_the_controller(name: str, solved: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    controller, reference, start = LOOPS[name]
    steps = 15 if name == "infeasible" else STEPS
    loop = simulate(controller, reference, start, steps, on_infeasible=apply_fallback)
    asked = len(solved)
    monkeypatch.setattr(RepeatedSteps, "step", lambda self, *given: self.controller.step(*given))
    every = simulate(controller, reference, start, steps, on_infeasible=apply_fallback)
    for part in fields(loop):
        if part.name != "without_plan":
            assert np.asarray(getattr(loop, part.name)).tobytes() == np.asarray(getattr(every, part.name)).tobytes()
    assert [each.k for each in loop.infeasible] == [each.k for each in every.infeasible]
    assert asked == steps if name == "infeasible" else asked < steps / 2


@dataclass(frozen=True, eq=False)
class Nudged(Reference):
    """A constant reference of which `nudged` is different by rounding at step 200."""

    nudged: str = "states"

    def window(self, k: int, horizon: int) -> Window:
        window = super().window(k, horizon)
        getattr(window, self.nudged)[max(0, 200 - k) : max(0, 201 - k)] += 1e-16
        return window


@pytest.mark.parametrize("nudged", ["states", "inputs"])
def test_a_difference_of_one_bit_anywhere_in_the_window_counts(nudged: str, solved: list[int]) -> None:
    controller, reference, start = LOOPS["linear"]
    simulate(controller, Nudged(reference.signals, reference.plant, nudged), start, STEPS)
    assert {201 - controller.horizon, 199, 200, 201} <= {*solved}
    assert 180 not in solved


def test_the_step_of_a_plan_is_its_own(solved: list[int]) -> None:
    controller, reference, _ = LOOPS["linear"]
    steps, state = RepeatedSteps(controller), reference.state(0)
    plans = [steps.step(k, state, reference, None) for k in range(3)]
    assert [plan.k for plan in plans] == [0, 1, 2]
    assert solved == [0]
    steps.step(3, np.nextafter(state, 1), reference, None)
    steps.step(4, np.nextafter(state, 1), reference, np.zeros((controller.horizon, 1)))
    assert solved == [0, 3, 4]
    for k in (188, 189, 195):
        steps.step(k, state, Nudged(reference.signals, reference.plant, "inputs"), None)
    assert solved == [0, 3, 4, 188, 195]
