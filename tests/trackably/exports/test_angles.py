"""A heading that passes π does not jump back to −π in what others follow."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.trackably.exports.references import robot
from tests.trackably.systems.forms.instances import T_S, eight
from trackably.arrays import Array

K = np.arange(300)


def headings() -> Array:
    found = np.unwrap(eight().state(K)[:, 2])
    assert np.abs(np.diff(eight().state(K)[:, 2])).max() > 6  # it does jump
    return np.asarray(found)


def test_do_mpc_sees_one_heading_from_step_to_step() -> None:
    """Whatever the order of the calls: each begins where the turns since time zero have led."""
    controller = SimpleNamespace(
        settings=SimpleNamespace(t_step=T_S, n_horizon=9),
        model=SimpleNamespace(tvp={"default": 0, "heading_ref": 0, "turn_ref": 0}),
        get_tvp_template=dict,
    )
    tvp = robot().to_do_mpc(controller)
    for k in (0, 251, 37, 120, 290):
        found = tvp(k * T_S)
        seen = [found["_tvp", j, "heading_ref"].item() for j in range(10)]
        np.testing.assert_allclose(seen, headings()[k : k + 10] if k < 290 else headings()[290:], atol=1e-9)
        assert found["_tvp", 3, "turn_ref"].item() == pytest.approx(eight().input(k + 3)[1], abs=1e-9)


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
