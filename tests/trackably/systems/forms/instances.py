"""A robot that drives along a figure eight."""

from functools import cache

import numpy as np

from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.flat_forms import FlatForm
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

T_S, PERIOD = 0.1, 12.0
STATES, INPUTS = ("x", "y", "heading"), ("speed", "turn")


def drives(state, inputs):
    """Euler's step of the unicycle."""
    x, y, heading = state
    speed, turn = inputs
    return [x + T_S * speed * np.cos(heading), y + T_S * speed * np.sin(heading), heading + T_S * turn]


def along(z):
    """The flat form: x and y are the flat outputs."""
    now, next_one = z[1] - z[0], z[2] - z[1]
    across, ahead = now[0] * next_one[1] - now[1] * next_one[0], now @ next_one
    return (
        [z[0][0], z[0][1], np.arctan2(now[1], now[0])],
        [np.hypot(now[0], now[1]) / T_S, np.arctan2(across, ahead) / T_S],
    )


def robot(flat=along, f=drives) -> NonlinearSystem:
    return NonlinearSystem.of(f, STATES, INPUTS, T_S, FlatForm.of(flat, outputs=2, angles=["heading"]))


def plant(slowest: float = 0.1, heading: float = np.inf) -> ConstrainedSystem:
    states = Polytope.box(np.array([-3.0, -3.0, -heading]), np.array([3.0, 3.0, heading]))
    return ConstrainedSystem(robot(), states, Polytope.box(np.array([slowest, -2.5]), np.array([1.5, 2.5])))


def through(values) -> KernelSum:
    """A periodic signal through values at equal distances of time."""
    kernel, times = Periodic(1.0, 1.0, PERIOD), np.arange(len(values)) * PERIOD / len(values)
    gram = kernel.jet(times[:, None] - times, 0)[0]
    return KernelSum(kernel, 0.0, times, np.linalg.solve(gram + 1e-8 * np.eye(len(times)), values))


@cache
def eight(width: float = 1.5, height: float = 0.8, slowest: float = 0.1, heading: float = np.inf) -> Reference:
    phase = 2 * np.pi * np.arange(24) / 24
    signals = through(width * np.sin(phase)), through(height * np.sin(2 * phase))
    return Reference(signals, plant(slowest, heading))


@cache
def certificate() -> dict:
    found = prove(eight())
    assert isinstance(found, Certificate)
    return encode_certificate(found)
