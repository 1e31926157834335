"""Controllers with trackable references: random systems, a double integrator, nonlinear systems, and a robot."""

from dataclasses import dataclass, replace

import numpy as np

from pipeline.loops.disturbed import near_bounds
from tests.trackably.systems.disturbance.instances import random_disturbed
from tests.trackably.systems.forms.instances import eight
from trackably.control.controller import Controller
from trackably.control.stepping import Plan
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.library import tank
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

STEPS = 200


def double_integrator(position=(-1.0, 1.2), velocity=(-2.0, 2.0), acceleration=(-4.0, 4.0)) -> ConstrainedSystem:
    system = LinearSystem.discretised(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), 0.05)
    states = Polytope.box(*np.array([position, velocity]).T)
    return ConstrainedSystem(system, states, Polytope.box(*np.array([acceleration]).T))


def controller_of(plant: ConstrainedSystem) -> Controller:
    """Return a controller of a double integrator."""
    return Controller(plant, 20, np.diag([10.0, 1.0]), 0.1 * np.eye(1))


def at_rest(plant: ConstrainedSystem, level: float = 0.0) -> Reference:
    """Return a constant reference."""
    nothing = KernelSum(SquaredExponential(1.0, 1.0), level, np.zeros(1), np.zeros(1))
    return Reference((nothing,) * plant.signal_count, plant)


@dataclass(frozen=True)
class Instance:
    controller: Controller
    reference: Reference
    start: np.ndarray


def instance(seed: int) -> Instance:
    """Return a random system, stable or not, with a reference that touches a bound where 3 divides `seed`.

    Inputs are short where `seed` is odd. The initial state is off the reference: a random distance, halved until the
    controller has a plan.
    """
    rng, plant = np.random.default_rng(seed), random_disturbed(seed).plant
    if seed % 2:
        plant = replace(plant, input_set=Polytope.box(plant.input_set.lower / 20, plant.input_set.upper / 20))
    controller = Controller(plant, int(rng.integers(5, 21)))
    reference = near_bounds(plant, rng, STEPS + 20, 1.0 if seed % 3 == 0 else rng.uniform(0.6, 0.98))
    away = (plant.state_set.upper - plant.state_set.lower) * rng.standard_normal(plant.state_set.dimension)
    while not isinstance(controller.step(0, reference.state(0) + away, reference), Plan):
        away = away / 2
    return Instance(controller, reference, reference.state(0) + away)


def first_outside(reference: Reference, bounds, values) -> int:
    """Return the first of 3000 steps at which the `values` of a reference violate their bounds."""
    return int(np.flatnonzero(bounds.margin(values(np.arange(3000))) < 0)[0])


TANK = ConstrainedSystem(tank(5.0, outflow=0.05), Polytope.box([0.3], [1.25]), Polytope.box([0.02], [0.068]))
PAIR = ConstrainedSystem(
    NonlinearSystem.of(
        lambda x, u: [0.9 * x[0] + 0.3 * np.sin(x[1]) + u[0], 0.8 * x[1] + 0.2 * x[0] * x[1] + (1 + x[0] ** 2) * u[1]],
        ["a", "b"],
        ["u", "w"],
        0.1,
    ),
    Polytope.box([-2.0, -2.0], [2.0, 2.0]),
    Polytope.box([-0.25, -0.3], [0.25, 0.3]),
)


def bump(plant: ConstrainedSystem, levels: list[float], heights: list[float], width: float) -> Reference:
    """Return a reference that leaves its levels once, by these heights."""
    signals = tuple(
        KernelSum(SquaredExponential(1.0, width), level, np.array([4 * width]), np.array([height]))
        for level, height in zip(levels, heights, strict=True)
    )
    return Reference(signals, plant)


NONLINEAR = {
    "tank": Instance(Controller(TANK, 12, np.eye(1), np.eye(1)), bump(TANK, [0.8], [0.3], 60.0), np.array([0.6])),
    "pair": Instance(
        Controller(PAIR, 8, np.eye(2), 0.1 * np.eye(2)),
        bump(PAIR, [0.1, 0.0], [0.3, 0.4], 1.0),
        np.array([1.0, -0.7]),
    ),
}


def robot_beside_its_path() -> Instance:
    """Return a robot beside a figure eight and a little ahead, with a heading in (−π, π]."""
    reference = eight()
    controller = Controller(reference.plant, 20, np.diag([1.0, 1.0, 0.5]), np.diag([0.5, 0.5]))
    return Instance(controller, reference, reference.state(0) + np.array([-0.1, 0.3, -0.4]))
