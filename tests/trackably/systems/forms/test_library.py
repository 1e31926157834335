"""Systems that come with the library follow the differential equations that they are made from."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from trackably.systems.library import GRAVITY, kinematic_bicycle, mobile_robot, pendulum, tank, two_tanks

SYSTEMS = {
    "mobile_robot": (
        mobile_robot,
        lambda x, u: [u[0] * np.cos(x[2]), u[0] * np.sin(x[2]), u[1]],
        ([0.3, -0.2, 0.7], [0.8, 0.5]),
    ),
    "bicycle": (
        lambda h: kinematic_bicycle(h, 2.7),
        lambda x, u: [u[0] * np.cos(x[2]), u[0] * np.sin(x[2]), u[0] * np.tan(u[1]) / 2.7],
        ([0.3, -0.2, 0.7], [8.0, 0.2]),
    ),
    "tank": (tank, lambda x, u: [(u[0] - 0.6 * np.sqrt(x[0])) / 2.0], ([0.8], [0.4])),
    "two_tanks": (
        two_tanks,
        lambda x, u: [(u[0] - 0.6 * np.sqrt(x[0])) / 2.0, 0.6 * (np.sqrt(x[0]) - np.sqrt(x[1])) / 2.0],
        ([0.8, 0.5], [0.4]),
    ),
    "pendulum": (
        pendulum,
        lambda x, u: [x[1], (u[0] - 0.02 * x[1]) / (0.2 * 0.5**2) - GRAVITY / 0.5 * np.sin(x[0])],
        ([0.8, -0.5], [0.1]),
    ),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_steps_approach_the_differential_equation(name):
    system_of, rate, (start, u) = SYSTEMS[name]
    solved = solve_ivp(lambda t, x: rate(x, u), (0.0, 0.2), start, rtol=1e-11, atol=1e-12).y[:, -1]

    def error(steps):
        system, x = system_of(0.2 / steps), np.array(start)
        for _ in range(steps):
            x = system.successor(x, np.array(u))
        return np.max(np.abs(x - solved))

    assert error(20) < 0.08
    assert error(40) < 0.6 * error(20)  # Euler's method: half the step, half the error
