"""A cart that two inputs push alike, under disturbance."""

import json
from dataclasses import replace

import numpy as np

from tests.trackable.systems.disturbance.instances import CART
from trackable.certificates.certificate import Certificate
from trackable.certificates.form import encode_certificate
from trackable.certificates.prove import prove_on_window
from trackable.certificates.robust import robust_of
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.signal import KernelSum
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.disturbance.tightening import tightening
from trackable.systems.disturbance.zonotope import Zonotope
from trackable.systems.linear import LinearSystem
from trackable.systems.reference import Reference
from trackable.systems.sets.polytope import Polytope


def two_pushers() -> dict:
    system = LinearSystem(CART.system.A, np.hstack([CART.system.B, CART.system.B]), sampling_time=0.1)
    plant = ConstrainedSystem(system, CART.state_set, Polytope.box([-1.0, -1.5], [1.0, 1.5]))
    drawn = tightening(plant, Zonotope.box([0.0, -0.02], [0.0, 0.02]))
    signal = KernelSum(SquaredExponential(1.0, 1.0), 0.0, np.array([0.0, 2.0]), np.array([0.2, -0.3]))
    found = prove_on_window(Reference((signal,), drawn.plant), 0.0, 3.0)
    assert isinstance(found, Certificate)
    return json.loads(json.dumps(encode_certificate(replace(found, robust=robust_of(drawn)))))
