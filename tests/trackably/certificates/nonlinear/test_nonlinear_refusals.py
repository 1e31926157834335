"""No certificate of a nonlinear system is given for what is false or not shown; the reason is told."""

import numpy as np

from tests.trackably.certificates.nonlinear.instances import BOX, WIDE, with_sets
from tests.trackably.systems.nonlinear_instances import INSTANCES, moving
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.prove import prove as prove_always
from trackably.certificates.prove import prove_on_window


def test_a_set_with_states_that_have_no_input_is_refused():
    found = prove_always(with_sets("tank", BOX([0.0], [9.0]), WIDE))
    assert isinstance(found, Unproved)
    assert "with states anywhere in their set, the argument of a square root may not be positive" in (found.explanation)
    assert found.explanation.startswith("it is not proved at any time that the inflow stays in [")
    assert "inf" not in found.explanation.replace("inflow", "")


def test_a_broken_state_bound_is_told_even_then():
    seen = moving(INSTANCES["tank"]).state_at(np.linspace(0, 1, 100))
    found = prove_always(with_sets("tank", BOX([0.0], [seen.min() + 1e-3]), WIDE))
    assert isinstance(found, Counterexample)
    assert found.quantity == "level"


def test_states_that_leave_the_domain_have_no_input():
    found = prove_on_window(with_sets("tank", BOX([-9.0], [9.0]), WIDE, size=3.0), 0.0, 2.0)
    assert isinstance(found, Unproved)
    assert "positive; a lower bound above zero of the states in it would keep it positive" in found.explanation
    assert found.quantity == "inflow"
    assert "the argument of a square root may not be positive" in found.explanation


def test_a_gain_that_may_be_zero_is_not_divided_by():
    found = prove_on_window(with_sets("harvest", BOX([-9.0], [9.0]), WIDE, size=3.0), 0.0, 2.0)
    assert isinstance(found, Unproved | Counterexample)
    assert found.quantity == "effort"
    certain = with_sets("harvest", BOX([-0.5], [2.0]), WIDE)
    found = prove_always(certain)
    assert isinstance(found, Unproved)
    assert "with states anywhere in their set, what it divides by may be zero" in found.explanation
