"""A heading that passes π does not jump back to −π in what acados follows; for do-mpc see `test_do_mpc`."""

import numpy as np

from tests.trackably.exports.references import robot
from tests.trackably.systems.forms.instances import eight


def test_acados_is_told_of_the_turns_that_are_near_the_plant() -> None:
    sliding = robot().to_acados(20)
    for k, turns in ((0, 0), (40, 3), (200, -2)):
        state = np.add(eight().state(k), [0.0, 0.0, 2 * np.pi * turns + 0.4])
        yref, yref_e = sliding.at(k, state)
        angles = np.append(yref[:, 2], yref_e[2])
        assert abs(angles[0] - state[2]) < 0.5
        assert np.abs(np.diff(angles)).max() < 1
        np.testing.assert_allclose(np.exp(1j * angles), np.exp(1j * eight().state(k + np.arange(21))[:, 2]), atol=1e-9)
        assert np.abs(np.diff(np.append(sliding.at(k).yref[:, 2], sliding.at(k).yref_e[2]))).max() < 1
