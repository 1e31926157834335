"""Certificates of nonlinear systems: found and checked."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.trackably.certificates.decoded import as_read, decode_certificate
from tests.trackably.certificates.nonlinear.instances import (
    END,
    assert_true,
    bounded,
    periodic,
    proved,
    tight,
    with_states,
)
from tests.trackably.systems.nonlinear_instances import INSTANCES, LINEAR, as_formulas, exactly, moving
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.prove import prove
from trackably.checker import Proved, check
from trackably.checker.certificate import Instants, Window
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

KEPT = {
    **{name: (name, partial(proved, name), END) for name in INSTANCES},
    "a tank that may be empty": ("tank", lambda: prove(with_states("tank", 0.0)), END),
    "a stock that may be nothing": ("harvest", lambda: prove(with_states("harvest", -0.5)), END),
    "a window": ("harvest", lambda: prove(tight("harvest", 1.0), Window(0.0, 1.0)), 1.0),
    "instants": ("tank", lambda: prove(tight("tank"), Instants()), END),
    "all phases": ("tank", lambda: prove(periodic()), END),
}
"""Of every claim; sets may hold states that have no input, where the reference never is."""


@pytest.mark.parametrize(("name", "make", "end"), KEPT.values(), ids=KEPT)
def test_certificates_are_found_and_checked_and_true(name, make, end):
    found = make()
    assert isinstance(found, Certificate), found.explanation
    assert_true(found, partial(exactly, INSTANCES[name], found.reference), end)
    data = as_read(found)
    verdict = check(data)
    assert isinstance(verdict, Proved), verdict
    assert all(f'"{state}"⁺ = ' in verdict.statement for state in INSTANCES[name].states)
    assert as_read(decode_certificate(data)) == data


@pytest.mark.parametrize("name", INSTANCES)
def test_an_input_bound_that_is_broken_is_refuted(name):
    reference = tight(name, room=-1e-3)
    found = prove(reference)
    assert isinstance(found, Counterexample), found.explanation
    assert_true(found, partial(exactly, INSTANCES[name], reference), END)


def test_a_state_bound_that_is_broken_is_refuted_where_some_states_have_no_input():
    seen = moving(INSTANCES["tank"]).state_at(np.linspace(0, 1, 100))
    found = prove(with_states("tank", 0.0, seen.min() + 1e-3))
    assert isinstance(found, Counterexample)
    assert found.quantity == "level"


def test_states_that_leave_the_domain_have_no_input():
    found = prove(with_states("tank", -9.0, size=3.0), Window(0.0, 2.0))
    assert isinstance(found, Unproved)
    assert found.quantity == "inflow"
    assert "the argument of a square root may not be positive; a lower bound above zero" in found.explanation


@pytest.mark.parametrize("seed", [1, 2])
def test_a_gain_that_may_be_zero_is_not_divided_by(seed):
    """The stock falls below zero, and so is zero at some time."""
    found = prove(with_states("harvest", -9.0, size=3.0, seed=seed), Window(0.0, 2.0))
    assert isinstance(found, Unproved | Counterexample)
    assert found.quantity == "effort"


@pytest.mark.parametrize("exact", [False, True])
def test_an_input_that_is_a_number_has_a_verdict(exact):
    """A flat form may give an input by a formula of no signal, in the tail, too."""
    data = as_read(proved("tank"))
    plant, cover = data["reference"]["plant"], data["claim"]["covers"]["level"]
    plant["system"] |= {"states": ["x"], "inputs": ["u", "w"], "f": [["+", "u", ["*", 0.0, "w"]]]}
    plant["system"]["flat"] = {"states": ["z1[0]"], "inputs": ["z1[1]", 0.5]}
    for side, count in (("state_set", 1), ("input_set", 2)):
        ends = {"lower": [-10.0] * count, "upper": [10.0] * count, "dimension": count}
        plant[side] = {"rows": np.eye(count).tolist(), **ends}
    data["evaluation"]["errors"] = dict.fromkeys("xuw", 1e-10)
    data["claim"]["covers"] = dict.fromkeys("xuw", cover)
    assert isinstance(check(data, exact=exact), Proved)


def test_rows_of_several_inputs():
    plant = INSTANCES["reactor"].plant
    rows = Polytope([[1.0, 1.0], [0.5, -1.0]], [-9.0, -9.0], [9.0, 9.0])
    reference = replace(moving(INSTANCES["reactor"], size=0.1), plant=replace(plant, input_set=rows))
    found = prove(reference, Window(0.0, 0.5))
    assert isinstance(found, Certificate), found.explanation
    assert '-9.0 ≤ 0.5 "feed" + -1.0 "cooling" ≤ 9.0' in check(as_read(found)).statement


# ---- linear systems written as nonlinear ones


@pytest.mark.parametrize("room", [1e-3, -1e-3])
def test_a_linear_system_written_as_a_nonlinear_one_has_the_same_verdict(room):
    signals, sets = moving(INSTANCES["vehicle"], seed=3).signals, Polytope.box([-9.0, -9.0], [9.0, 9.0])
    loose = Reference(signals, ConstrainedSystem(LINEAR, sets, sets))
    plain = bounded(loose, np.linspace(0, END, 1001), room)
    written = replace(plain, plant=replace(plain.plant, system=as_formulas(LINEAR)))
    first, second = prove(plain), prove(written)
    assert type(first) is type(second) is (Certificate if room > 0 else Counterexample)
    if isinstance(first, Certificate):
        assert first.claim == second.claim
        for name, error in first.evaluation_error.items():
            assert second.evaluation_error[name] < 20 * error
    else:
        assert first.quantity == second.quantity
        assert first.violation == pytest.approx(second.violation, abs=1e-9)
