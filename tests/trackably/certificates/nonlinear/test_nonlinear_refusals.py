"""No certificate of a nonlinear system is given for what is false or not shown; the reason is told."""

import numpy as np
import pytest

from tests.trackably.certificates.decoded import as_read
from tests.trackably.certificates.nonlinear.instances import proved, true_values, with_states
from tests.trackably.systems.nonlinear_instances import INSTANCES, moving
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.prove import prove as prove_always
from trackably.certificates.prove import prove_on_window
from trackably.checker import Proved, check


@pytest.mark.parametrize(("name", "lower"), [("tank", 0.0), ("harvest", -0.5)])
def test_a_set_may_hold_states_that_have_no_input_where_the_reference_never_is(name, lower):
    """An empty tank, or a stock of nothing; values in float64 are as near to the true ones as is proved."""
    found = prove_always(with_states(name, lower))
    assert isinstance(found, Certificate), found
    times = np.linspace(0.0, 3.0, 200)
    for quantity, error in found.evaluation_error.items():
        values = found.reference.quantity(quantity)([z.summed for z in found.reference.kernel_sums], times)
        true = true_values(name, found.reference, times.tolist())[quantity]
        assert max(abs(of - float(value)) for of, value in zip(true, values, strict=True)) <= error


def test_a_broken_state_bound_is_told_even_then():
    seen = moving(INSTANCES["tank"]).state_at(np.linspace(0, 1, 100))
    found = prove_always(with_states("tank", 0.0, seen.min() + 1e-3))
    assert isinstance(found, Counterexample)
    assert found.quantity == "level"


def test_states_that_leave_the_domain_have_no_input():
    found = prove_on_window(with_states("tank", -9.0, size=3.0), 0.0, 2.0)
    assert isinstance(found, Unproved)
    assert found.quantity == "inflow"
    assert "the argument of a square root may not be positive; a lower bound above zero" in found.explanation


@pytest.mark.parametrize("seed", [1, 2])
def test_a_gain_that_may_be_zero_is_not_divided_by(seed):
    """The stock falls below zero, and so is zero at some time."""
    found = prove_on_window(with_states("harvest", -9.0, size=3.0, seed=seed), 0.0, 2.0)
    assert isinstance(found, Unproved | Counterexample)
    assert found.quantity == "effort"


@pytest.mark.parametrize("exact", [False, True])
def test_an_input_that_is_a_number_has_a_verdict(exact):
    """A flat form may give an input by a formula of no signal, in the tail, too."""
    data = as_read(proved("tank"))
    plant, cover = data["reference"]["plant"], data["claim"]["covers"]["level"]
    plant["system"] |= {"states": ["x"], "inputs": ["u", "w"], "f": [["+", "u", ["*", 0.0, "w"]]]}
    plant["system"]["flat"] = {"states": ["z1[0]"], "inputs": ["z1[1]", 0.5]}
    for side, rows in (("state_set", np.eye(1)), ("input_set", np.eye(2))):
        ends = {"lower": [-10.0] * len(rows), "upper": [10.0] * len(rows), "dimension": len(rows)}
        plant[side] = {"rows": rows.tolist(), **ends}
    data["evaluation"]["errors"] = dict.fromkeys("xuw", 1e-10)
    data["claim"]["covers"] = dict.fromkeys("xuw", cover)
    assert isinstance(check(data, exact=exact), Proved)
