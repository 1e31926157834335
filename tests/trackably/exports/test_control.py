"""python-control simulates references and finds its own trajectories' interface in them."""

import control
import control.flatsys
import numpy as np
import pytest

from tests.trackably.exports.references import EVERY, all_times, nonlinear, on_window, periodic

every = pytest.mark.parametrize("name", EVERY)


@pytest.mark.parametrize("of", [all_times, on_window, periodic], ids=lambda of: of.__name__)
def test_control_simulates_the_same_states(of) -> None:  # type: ignore[no-untyped-def]
    reference = of()
    system = reference.reference.plant.linear
    theirs = control.ss(system.A, system.B, np.eye(len(system.A)), 0, system.sampling_time)
    mine = reference.to_control().response()
    assert mine.time.size > 15
    simulated = control.input_output_response(theirs, mine.time, mine.inputs, mine.states[:, 0])
    np.testing.assert_allclose(simulated.states, mine.states, atol=1e-9)


def test_control_simulates_a_nonlinear_system() -> None:
    mine = nonlinear().to_control().response()
    theirs = control.nlsys(
        lambda t, x, u, params: x - 0.1 * x**2 + 0.5 * u, inputs=mine.input_labels, states=mine.state_labels, dt=0.2
    )
    simulated = control.input_output_response(theirs, mine.time, mine.inputs, mine.states[:, 0])
    np.testing.assert_allclose(simulated.states, mine.states, atol=1e-9)


def test_it_has_what_a_trajectory_and_a_response_of_control_have() -> None:
    """Shapes, too, are those that python-control gives for a flat system of the same size."""
    mine = all_times().to_control()
    axis = control.flatsys.FlatSystem(
        lambda x, u, params: [np.array([x[0], x[1], u[0]])],
        lambda flag, params: (flag[0][:2], flag[0][2:3]),
        lambda t, x, u, params: np.array([x[1], u[0]]),
        lambda t, x, u, params: x,
        inputs=1,
        states=2,
        outputs=2,
    )
    theirs = control.flatsys.point_to_point(axis, 1.0, [0, 0], [0], [1, 0], [0])
    times = np.linspace(0, 1, 7)
    for ours, of_control in zip(mine.eval(times), theirs.eval(times), strict=True):
        assert ours.shape == of_control.shape
    answer, response = mine.response(times), theirs.response(times)
    for name in ("time", "states", "inputs", "outputs"):
        assert np.shape(getattr(answer, name)) == np.shape(getattr(response, name)), name
    for name in ("state_labels", "input_labels", "output_labels"):
        assert len(getattr(answer, name)) == len(getattr(response, name))
    time, outputs = answer
    np.testing.assert_array_equal(time, times)
    np.testing.assert_array_equal(outputs, all_times()(times).T)
    assert (mine.nstates, mine.ninputs) == (theirs.nstates, theirs.ninputs)


def test_times_that_are_not_proved_are_refused() -> None:
    with pytest.raises(ValueError, match="outside of what is proved"):
        on_window().to_control().eval([0.0, 3.1])


@every
def test_a_response_covers_the_steps_that_are_proved(name: str) -> None:
    reference = EVERY[name]()
    answer, plant = reference.to_control().response(), reference.reference.plant
    np.testing.assert_allclose(np.diff(answer.time), plant.sampling_time)
    assert answer.time[0] == 0
    expected = {"on_window": 3.0, "periodic": 2.0, "nonlinear": 3.0}.get(name, answer.time[-1])
    assert answer.time[-1] == pytest.approx(expected)
