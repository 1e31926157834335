"""do-mpc follows references that are handed over as its time-varying parameters."""

import warnings
from typing import Any

import numpy as np
import pytest

from tests.trackably.exports.references import all_times, robot

with warnings.catch_warnings():  # of parts of do-mpc that are not installed
    warnings.simplefilter("ignore")
    from do_mpc.controller import MPC
    from do_mpc.model import Model
    from do_mpc.simulator import Simulator

pytestmark = pytest.mark.filterwarnings("ignore::FutureWarning")  # what do-mpc does with CasADi's matrices
HORIZON, K = 15, np.arange(300)


@pytest.mark.parametrize("kind", [MPC, Simulator])
@pytest.mark.parametrize("of", [all_times, robot])
def test_each_stage_holds_states_and_inputs_of_its_step(of: Any, kind: Any) -> None:
    """And a heading that passes π, from step 44 to 74, does not jump, whatever the order of the calls."""
    reference, model = of(), Model("discrete", "SX")
    plant, T = reference.reference.plant, reference.reference.plant.sampling_time
    x, _ = model.set_variable("_x", "x"), model.set_variable("_u", "u")
    for name in plant.names:
        model.set_variable("_tvp", f"{name}_ref")
    model.set_rhs("x", x)
    model.setup()
    user, stages = kind(model), HORIZON + 1 if kind is MPC else 1
    user.set_param(t_step=T, **{"n_horizon": HORIZON} if kind is MPC else {})
    tvp = reference.to_do_mpc(user)
    wanted = np.hstack([np.unwrap(reference.state(K), axis=0), reference.input(K)])
    for t_now in (0.0, np.array([180 * T]), sum([T] * 40), 60 * T):
        k = round(np.asarray(t_now).item() / T)
        found = tvp(t_now)
        for j in range(stages):
            stage = ("_tvp", j) if kind is MPC else ()
            got = [float(found[(*stage, f"{name}_ref")]) for name in plant.names]
            np.testing.assert_allclose(got, wanted[k + j], atol=1e-9)
