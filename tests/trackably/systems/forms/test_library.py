"""Systems that come with the library are Euler's steps of the differential equations that they are made from."""

import numpy as np
import pytest

from trackably.systems.library import GRAVITY, kinematic_bicycle, mobile_robot, pendulum, tank, two_tanks

STEP = 0.05
RATES = {
    "mobile_robot": (mobile_robot(STEP), lambda x, u: [u[0] * np.cos(x[2]), u[0] * np.sin(x[2]), u[1]]),
    "bicycle": (
        kinematic_bicycle(STEP, 2.7),
        lambda x, u: [u[0] * np.cos(x[2]), u[0] * np.sin(x[2]), u[0] * np.tan(u[1]) / 2.7],
    ),
    "tank": (tank(STEP), lambda x, u: [(u[0] - 0.6 * np.sqrt(x[0])) / 2.0]),
    "two_tanks": (
        two_tanks(STEP),
        lambda x, u: [(u[0] - 0.6 * np.sqrt(x[0])) / 2.0, 0.6 * (np.sqrt(x[0]) - np.sqrt(x[1])) / 2.0],
    ),
    "pendulum": (
        pendulum(STEP),
        lambda x, u: [x[1], (u[0] - 0.02 * x[1]) / (0.2 * 0.5**2) - GRAVITY / 0.5 * np.sin(x[0])],
    ),
}


@pytest.mark.parametrize("name", RATES)
def test_a_step_is_eulers(name):
    (system, rate), rng = RATES[name], np.random.default_rng(0)
    x, u = rng.uniform(0.2, 1.0, len(system.states)), rng.uniform(0.2, 1.0, len(system.inputs))
    np.testing.assert_allclose((system.successor(x, u) - x) / STEP, rate(x, u), rtol=1e-12)
