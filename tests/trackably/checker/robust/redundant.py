"""A cart that two inputs push alike, under disturbance."""

import numpy as np

from tests.trackably.certificates.decoded import as_read
from tests.trackably.systems.disturbance.instances import CART
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove
from trackably.checker.certificate import Window
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.tightening import tightening


def two_pushers() -> dict:
    system = LinearSystem(CART.system.A, np.hstack([CART.system.B, CART.system.B]), sampling_time=0.1)
    plant = ConstrainedSystem(system, CART.state_set, Polytope.box([-1.0, -1.5], [1.0, 1.5]))
    drawn = tightening(plant, Zonotope.box([0.0, -0.02], [0.0, 0.02]))
    signal = KernelSum(SquaredExponential(1.0, 1.0), 0.0, np.array([0.0, 2.0]), np.array([0.2, -0.3]))
    found = prove(Reference((signal,), drawn.plant), Window(0.0, 3.0))
    assert isinstance(found, Certificate)
    return as_read(found.with_robust(drawn))
