"""Trajectories of python-control are taken as they are."""

import control
import control.flatsys as fs
import numpy as np
import pytest

from tests.trackably.plants import AXIS
from trackably import CertifiedReference, certify

CONTINUOUS = control.ss(
    [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], states=["position", "velocity"], inputs=["force"]
)
BASES = {
    "powers": fs.PolyFamily(6, T=3.0),
    "bernstein": fs.BezierFamily(6, T=3.0),
    "b-splines": fs.BSplineFamily([0.0, 1.0, 2.0, 3.0], 4),
}


@pytest.mark.parametrize("basis", BASES)
def test_flat_trajectories_are_certified(basis):
    system = fs.LinearFlatSystem(CONTINUOUS)
    trajectory = fs.point_to_point(system, [0, 3.0], [-1, 0], [0], [0, 0], [0], basis=BASES[basis])
    found = certify(trajectory, AXIS, "all_times")
    assert isinstance(found, CertifiedReference)
    k = np.arange(5, 55)
    states = trajectory.eval(0.05 * k)[0].T
    assert np.max(np.abs(found.state(k)[:, 0] - states[:, 0])) <= found.off["position"] + 1e-12 < 5e-4
    assert np.max(np.abs(found.state(k)[:, 1] - states[:, 1])) < 5e-3
