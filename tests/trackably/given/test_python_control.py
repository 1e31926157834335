"""Systems of python-control are taken as they are."""

import control
import numpy as np
import pytest

from tests.trackably.plants import AXIS
from trackably import ConstrainedSystem, LinearSystem

CONTINUOUS = control.ss(
    [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], states=["position", "velocity"], inputs=["force"]
)
PLANT = ConstrainedSystem(LinearSystem.of_state_space(CONTINUOUS, 0.05), AXIS.state_set, AXIS.input_set)


def test_a_state_space_is_a_plant():
    assert np.array_equal(PLANT.system.A, AXIS.system.A)
    assert (PLANT.system.states, PLANT.system.inputs) == (("position", "velocity"), ("force",))
    sampled = LinearSystem.of_state_space(control.ss(AXIS.system.A, AXIS.system.B, np.eye(2), 0, 0.05))
    assert (sampled.sampling_time, sampled.states) == (0.05, ("x1", "x2")), "x[0] is no identifier"
    with pytest.raises(ValueError, match="sampling time"):
        LinearSystem.of_state_space(CONTINUOUS)
