"""do-mpc follows references that are handed over as its time-varying parameters."""

import warnings
from typing import Any

import numpy as np
import pytest

from tests.trackably.exports.references import all_times

with warnings.catch_warnings():  # of parts of do-mpc that are not installed
    warnings.simplefilter("ignore")
    from do_mpc.controller import MPC
    from do_mpc.model import Model
    from do_mpc.simulator import Simulator

pytestmark = pytest.mark.filterwarnings("ignore::FutureWarning")  # what do-mpc does with CasADi's matrices
HORIZON, NAMES = 15, ("position", "velocity", "force")


@pytest.mark.parametrize("kind", [MPC, Simulator])
def test_each_stage_holds_states_and_inputs_of_its_step(kind: Any) -> None:
    reference, model = all_times(), Model("discrete", "SX")
    x, _ = model.set_variable("_x", "x"), model.set_variable("_u", "u")
    for name in NAMES:
        model.set_variable("_tvp", f"{name}_ref")
    model.set_variable("_tvp", "both", (2, 1))
    model.set_rhs("x", x)
    model.setup()
    user, stages = kind(model), HORIZON + 1 if kind is MPC else 1
    user.set_param(t_step=0.05, **{"n_horizon": HORIZON} if kind is MPC else {})
    tvp, of_both = reference.to_do_mpc(user), reference.to_do_mpc(user, {"both": ["velocity", "position"]})
    for t_now in (0.0, np.array([0.35]), sum([0.05] * 40)):
        k = round(float(np.asarray(t_now).item()) / 0.05)
        found, both = tvp(t_now), of_both(t_now)
        for j in range(stages):
            got = [float(found["_tvp", j, f"{name}_ref"] if kind is MPC else found[f"{name}_ref"]) for name in NAMES]
            np.testing.assert_allclose(got, [*reference.state(k + j), *reference.input(k + j)], atol=1e-12)
            several = both["_tvp", j, "both"] if kind is MPC else both["both"]
            np.testing.assert_allclose(several.full().ravel(), got[1::-1], atol=1e-12)
