"""Random steps of a scalar nonlinear system: the controller's answer beside what exact reachable intervals say."""

from dataclasses import dataclass

import numpy as np

from tests.local_search.reachability import Sine
from trackably.control.controller import Controller
from trackably.control.stepping import StepResult
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference


@dataclass(frozen=True)
class Case:
    """A controller at step 0 in `state`, with a reference of its system."""

    sine: Sine
    controller: Controller
    reference: Reference
    state: np.ndarray

    @property
    def slack(self) -> float:
        """How far inside of what is reached the reference is at the end of the horizon."""
        N = self.controller.horizon
        return self.sine.slack(float(self.state[0]), float(self.reference.state(N)[0]), N)

    @property
    def answer(self) -> StepResult:
        return self.controller.step(0, self.state, self.reference)


def plant(sine: Sine) -> ConstrainedSystem:
    system = NonlinearSystem.of(
        lambda x, u: [x[0] + sine.alpha * np.sin(4 * x[0]) + sine.gain * u[0]], ["x"], ["u"], 0.1
    )
    return ConstrainedSystem(system, Polytope.box([-sine.reach], [sine.reach]), Polytope.box([-sine.most], [sine.most]))


def cases(alpha: float, horizon: int, moving: bool, states: int) -> list[Case]:
    """Return random states, each with an equilibrium as its reference, or with a slow motion around one.

    |ẋ_r| ≤ 0.31, so that |u_r| ≤ 5 · (0.8 + 0.04) keeps its bounds at all times, as |x_r| ≤ 1.9 does.
    """
    sine = Sine(alpha)
    controller = Controller(plant(sine), horizon, np.eye(1), 0.1 * np.eye(1))
    seeds = ([round(10 * alpha), horizon, moving, number] for number in range(states))
    return [_case(sine, controller, moving, np.random.default_rng(seed)) for seed in seeds]


def _case(sine: Sine, controller: Controller, moving: bool, rng: np.random.Generator) -> Case:
    state, level, centre = rng.uniform(-sine.reach, sine.reach, 1), rng.uniform(-1.4, 1.4), rng.uniform(-1.0, 2.0)
    height = rng.uniform(-0.5, 0.5) if moving else 0.0
    signal = KernelSum(SquaredExponential(1.0, 1.0), level, np.array([centre]), np.array([height]))
    return Case(sine, controller, Reference((signal,), controller.plant), state)
