"""do-mpc follows references that are handed over as its time-varying parameters."""

from typing import Any

import numpy as np
import pytest

from tests.trackably.exports.do_mpc_loop import MPC, loop, model_of
from tests.trackably.exports.references import all_times

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


def test_each_stage_holds_states_and_inputs_of_its_step() -> None:
    reference = all_times()
    tvp = reference.to_do_mpc(controller_for(reference, model_of(reference)))
    for t_now in (0.0, np.array([0.35]), sum([0.05] * 40)):
        k = round(float(np.asarray(t_now).item()) / 0.05)
        found = tvp(t_now)
        for j in range(HORIZON + 1):
            got = [float(found["_tvp", j, f"{name}_ref"]) for name in ("position", "velocity", "force")]
            np.testing.assert_allclose(got, [*reference.state(k + j), *reference.input(k + j)], atol=1e-12)
