"""Controllers with trackable references: random systems, a double integrator, nonlinear systems, and a robot."""

from dataclasses import dataclass

import numpy as np

from tests.trackably.systems.forms.instances import T_S, robot
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference
from trackably.control.stepping import Plan
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.library import tank
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference, Window

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
    reference: Reference | TabulatedReference
    start: np.ndarray


def instance(seed: int) -> Instance:
    """Return a system of up to four states and two inputs, stable or not. Where 3 divides `seed`, its reference
    touches its boxes.

    The boxes contain the reference up to step STEPS + N. The initial state is off the reference: a random distance,
    halved until the controller has a plan.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    m = int(rng.integers(1, min(n, 2) + 1))
    A = rng.standard_normal((n, n))
    A *= rng.uniform(0.5, 1.1) / max(abs(np.linalg.eigvals(A)))
    sampling_time = 0.1
    system = LinearSystem(A, rng.standard_normal((n, m)), 0.1 * rng.standard_normal(n), sampling_time=sampling_time)
    horizon = int(rng.integers(max(n, 5), 21))
    free = ConstrainedSystem(
        system, Polytope.box([-np.inf] * n, [np.inf] * n), Polytope.box([-np.inf] * m, [np.inf] * m)
    )
    centres = np.arange(-1.0, (STEPS + horizon) * sampling_time + 1, 0.7)
    signals = tuple(
        KernelSum(SquaredExponential(1.0, 0.8), rng.normal(), centres, rng.standard_normal(centres.size))
        for _ in range(free.signal_count)
    )
    window = Reference(signals, free).window(0, STEPS + horizon)
    margin = 0.0 if seed % 3 == 0 else rng.uniform(0.02, 0.3)
    boxes = [_around(values, margin) for values in window]
    reference = Reference(signals, ConstrainedSystem(system, *boxes))
    weights = (np.diag(rng.uniform(0.1, 10, n)), np.diag(rng.uniform(0.01, 1, m)))
    controller = Controller(reference.plant, horizon, *weights)
    away = rng.standard_normal(n) * np.ptp(window.states, axis=0)
    while not isinstance(controller.step(0, window.states[0] + away, reference), Plan):
        away = away / 2
    return Instance(controller, reference, window.states[0] + away)


def _around(values: np.ndarray, margin: float) -> Polytope:
    pad = margin * np.ptp(values, axis=0)
    return Polytope.box(values.min(axis=0) - pad, values.max(axis=0) + pad)


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

ROBOT = ConstrainedSystem(
    robot(),
    Polytope.box([-3.0, -3.0, -np.inf], [3.0, 3.0, np.inf]),
    Polytope.box([0.4, -1.2], [1.1, 1.2]),
)


def robot_beside_its_path() -> Instance:
    """Return a robot beside its path and a little ahead: rounds of 1.2 m at 0.72 m/s, with a heading in (−π, π]."""
    t = np.arange(152) * T_S
    path = 1.2 * np.stack([np.cos(0.6 * t), np.sin(0.6 * t)], axis=1)
    moved = np.diff(path, axis=0)
    heading = np.arctan2(moved[:, 1], moved[:, 0])
    turn_rate = np.diff(np.unwrap(heading)) / T_S
    states = np.column_stack([path[:-1], heading])
    inputs = np.column_stack([np.linalg.norm(moved, axis=1)[:-1] / T_S, turn_rate])
    controller = Controller(ROBOT, 20, np.diag([1.0, 1.0, 0.5]), np.diag([0.5, 0.5]))
    return Instance(controller, TabulatedReference(0, Window(states, inputs)), states[0] + [-0.1, 0.3, -0.4])
