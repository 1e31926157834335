"""Trajectories and systems of python-control are taken as they are."""

import control
import control.flatsys as fs
import numpy as np
import pytest

from tests.trackably.plants import AXIS
from trackably import CertifiedReference, ConstrainedSystem, LinearSystem, certify

CONTINUOUS = control.ss(
    [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], states=["position", "velocity"], inputs=["force"]
)
PLANT = ConstrainedSystem(LinearSystem.of_state_space(CONTINUOUS, 0.05), AXIS.state_set, AXIS.input_set)
BASES = {
    "powers": fs.PolyFamily(6, T=3.0),
    "bernstein": fs.BezierFamily(6, T=3.0),
    "b-splines": fs.BSplineFamily([0.0, 1.0, 2.0, 3.0], 4),
}


def test_a_state_space_is_a_plant():
    assert np.array_equal(PLANT.system.A, AXIS.system.A)
    assert (PLANT.system.states, PLANT.system.inputs) == (("position", "velocity"), ("force",))
    sampled = LinearSystem.of_state_space(control.ss(AXIS.system.A, AXIS.system.B, np.eye(2), 0, 0.05))
    assert (sampled.sampling_time, sampled.states) == (0.05, ("x1", "x2")), "x[0] is no identifier"
    with pytest.raises(ValueError, match="sampling time"):
        LinearSystem.of_state_space(CONTINUOUS)


@pytest.mark.parametrize("basis", BASES)
def test_flat_trajectories_are_certified(basis):
    system = fs.LinearFlatSystem(CONTINUOUS)
    trajectory = fs.point_to_point(system, [0, 3.0], [-1, 0], [0], [0, 0], [0], basis=BASES[basis])
    found = certify(trajectory, PLANT, "all_times")
    assert isinstance(found, CertifiedReference)
    k = np.arange(5, 55)
    states = trajectory.eval(0.05 * k)[0].T
    assert np.max(np.abs(found.state(k)[:, 0] - states[:, 0])) <= found.off["position"] + 1e-12 < 5e-4
    assert np.max(np.abs(found.state(k)[:, 1] - states[:, 1])) < 5e-3
