"""do-mpc follows references that are handed over as its time-varying parameters."""

from typing import Any

import numpy as np
import pytest

from tests.trackably.exports.do_mpc_loop import MPC, Model, Simulator, loop, model_of
from tests.trackably.exports.references import all_times, on_window

pytestmark = pytest.mark.filterwarnings("ignore::FutureWarning")  # what do-mpc does with CasADi's matrices
HORIZON = 15


def controller_for(reference: Any, model: Any, horizon: int = HORIZON) -> Any:
    controller = MPC(model)
    controller.set_param(n_horizon=horizon, t_step=reference.reference.plant.sampling_time)
    return controller


def test_do_mpc_follows_a_reference_with_zero_terminal_error_where_bounds_are_active() -> None:
    reference, steps = all_times(), 60
    states, inputs, ends = loop(reference, HORIZON, steps)
    k = np.arange(steps + 1)
    np.testing.assert_allclose(states, reference.state(k), atol=1e-6)
    np.testing.assert_allclose(inputs, reference.input(k[:-1]), atol=1e-5)
    assert np.max(np.abs(ends)) < 1e-7
    assert inputs.max() == pytest.approx(2.5, rel=1e-5)  # the bound of the force
    assert inputs.max() < 2.5


def test_do_mpc_returns_to_a_reference_along_the_bounds() -> None:
    states, inputs, ends = loop(all_times(), HORIZON, 60, [-0.08, 0.0])
    assert np.sum(np.abs(np.abs(inputs) - 2.5) < 1e-6) + np.sum(np.abs(states[:, 1] - 1.0) < 1e-6) >= 3
    assert np.max(np.abs(ends[0])) > 1e-3
    assert np.max(np.abs(ends[-1])) < 1e-2 * np.max(np.abs(ends[0]))
    assert np.max(np.abs(states[-1] - all_times().state(60))) < 5e-3


def test_each_stage_holds_states_and_inputs_of_its_step() -> None:
    reference = all_times()
    tvp = reference.to_do_mpc(controller_for(reference, model_of(reference)))
    for t_now in (0.0, np.array([0.35]), sum([0.05] * 40)):
        k = round(float(np.asarray(t_now).item()) / 0.05)
        found = tvp(t_now)
        for j in range(HORIZON + 1):
            got = [float(found["_tvp", j, f"{name}_ref"]) for name in ("position", "velocity", "force")]
            np.testing.assert_allclose(got, [*reference.state(k + j), *reference.input(k + j)], atol=1e-12)


def test_vectors_are_filled_under_names_of_ones_own() -> None:
    reference = on_window()
    model = Model("discrete", "SX")
    x, u = model.set_variable("_x", "x", (2, 1)), model.set_variable("_u", "u")
    model.set_variable("_tvp", "goal", (2, 1))
    model.set_variable("_tvp", "push")
    model.set_variable("_tvp", "price")
    model.set_rhs("x", reference.reference.plant.linear.A @ x + reference.reference.plant.linear.B @ u)
    model.setup()
    parameters = {"goal": ["position", "velocity"], "push": "force"}
    later = reference.to_do_mpc(controller_for(reference, model), parameters, start=1.0)(0.1)
    np.testing.assert_allclose(np.array(later["_tvp", 3, "goal"])[:, 0], reference(1.25), atol=1e-12)
    assert float(later["_tvp", 3, "push"]) == pytest.approx(reference.eval(1.25).inputs[0], abs=1e-9)
    assert float(later["_tvp", 3, "price"]) == 0
    simulator = Simulator(model)
    simulator.set_param(t_step=0.05)
    np.testing.assert_allclose(np.array(reference.to_do_mpc(simulator, parameters)(0.2)["goal"])[:, 0], reference(0.2))
    with pytest.raises(ValueError, match="declares none of position_ref, velocity_ref, force_ref"):
        reference.to_do_mpc(simulator)
    with pytest.raises(ValueError, match="has no parameter aim, only goal, push, price"):
        reference.to_do_mpc(simulator, {"aim": "position"})
    with pytest.raises(ValueError, match="speed is neither a state nor an input"):
        reference.to_do_mpc(simulator, {"push": "speed"})


def test_a_horizon_beyond_what_is_proved_is_refused() -> None:
    reference = on_window()
    tvp = reference.to_do_mpc(controller_for(reference, model_of(reference)))
    tvp(3.0 - HORIZON * 0.05)
    with pytest.raises(ValueError, match=r"^t = 3.05 s is outside of what is proved, all real t from 0 s to 3 s"):
        tvp(3.05 - HORIZON * 0.05)
    with pytest.raises(ValueError, match=r"^tvp_fun: t_now = 0.07 s is no multiple of T_s = 0.05 s"):
        tvp(0.07)
