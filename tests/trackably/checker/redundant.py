"""References of systems with redundant inputs, and their certificates."""

from dataclasses import replace
from functools import cache

import numpy as np

from tests.trackably.systems.redundant_instances import ONE_STATE
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum
from trackably.reference.learn import learn_reference
from trackably.reference.trackable import TrackableReference
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

STEPS = np.arange(5000)
PLANT = ConstrainedSystem(ONE_STATE, Polytope.box([-3.0], [3.0]), Polytope.box([-1.0, -0.2], [1.0, 0.2]))
AXES = LinearSystem.discretised(
    np.kron(np.eye(2), np.array([[0.0, 1.0], [0.0, -0.5]])), np.eye(4)[:, 1::2], 0.1, states=("x", "vx", "y", "vy")
)
PLANE = ConstrainedSystem(
    replace(AXES, B=AXES.B @ np.array([[1.0, 0, 1, -1], [0, 1, 1, 1]]), inputs=("east", "north", "ne", "nw")),
    Polytope.box([-2.0] * 4, [2.0] * 4),
    Polytope.box([-0.2, -0.1, -0.3, -0.15], [0.2, 0.1, 0.3, 0.15]),
)


@cache
def learned() -> TrackableReference:
    """It needs more than the second of two equal inputs can give."""
    times = np.linspace(0, 8, 25)
    values = 2 * np.exp(-((times - 4) ** 2) / 4) + 0.05 * np.random.default_rng(1).normal(size=25)
    kernel = SquaredExponential()
    return learn_reference(Samples(times, values), PLANT, kernel, "all_times", noise_std=0.05, progress=False)


@cache
def in_the_plane() -> Certificate:
    signals = (
        KernelSum(SquaredExponential(1.0, 1.5), 0.0, np.array([0.0, 2.0]), np.array([0.6, -0.7])),
        KernelSum(SquaredExponential(1.0, 2.0), 0.1, np.array([1.0]), np.array([-0.6])),
    )
    found = prove(Reference(signals, PLANE))
    assert isinstance(found, Certificate)
    return found
