"""python-control simulates references and finds its own trajectories' interface in them."""

import control
import control.flatsys
import numpy as np
import pytest

from tests.trackably.exports.references import all_times, on_window, periodic


@pytest.mark.parametrize("of", [all_times, on_window, periodic], ids=lambda of: of.__name__)
def test_control_simulates_the_same_states(of) -> None:  # type: ignore[no-untyped-def]
    reference = of()
    system = reference.reference.plant.linear
    theirs = control.ss(system.A, system.B, np.eye(len(system.A)), 0, system.sampling_time)
    mine = reference.to_control().response()
    assert mine.time.size > 15
    simulated = control.input_output_response(theirs, mine.time, mine.inputs, mine.states[:, 0])
    np.testing.assert_allclose(simulated.states, mine.states, atol=1e-9)
