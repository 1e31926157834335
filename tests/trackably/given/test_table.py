"""Tables of states and inputs are proved at their steps, within a tolerance, or refuted by the largest violation."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.checker.changes import changed
from tests.trackably.exports.references import TANK
from tests.trackably.plants import AXIS, CART
from tests.trackably.systems.forms.instances import robot
from trackably import (
    CertifiedTable,
    ConstrainedSystem,
    Failed,
    NonlinearSystem,
    NotACertificate,
    Polytope,
    Proved,
    Refuted,
    RefutedTable,
    Table,
    Unproved,
    certify_table,
    check,
)


def followed(plant, steps=30):
    """States and inputs of the plant itself, rounded to float64."""
    x, states, inputs = np.full(len(plant.system.states), -0.3), [], []
    for k in range(steps):
        u = 0.1 * np.cos(np.arange(len(plant.system.inputs)) + k / 7)
        states.append(x)
        inputs.append(u)
        x = plant.system.successor(x, u)
    return Table(states, inputs, first_step=4)


each_plant = pytest.mark.parametrize("plant", [AXIS, CART, TANK], ids=["axis", "cart", "tank"])


@each_plant
def test_what_a_plant_did_is_certified(plant, tmp_path):
    found, data = answered(plant, {}, 1e-12, tmp_path)
    assert isinstance(found, CertifiedTable)
    assert 0 < found.tolerance < 1e-15
    assert "steps 4 to 33" in found.explanation
    verdict = check(data)
    assert isinstance(verdict, Proved)


@each_plant
def test_dynamics_beyond_the_tolerance_are_refuted_where_they_are_worst(plant, tmp_path):
    found, data = answered(plant, {11: 1e-3, 20: 4e-3}, 1e-6, tmp_path)
    assert isinstance(found, RefutedTable)
    verdict = check(data)
    assert isinstance(verdict, Refuted)
    assert f"at the step k = {found.step} " in verdict.statement
    assert found.step in (4 + 19, 4 + 20)
    assert found.time == found.step * plant.sampling_time
    assert 3e-3 < found.violation < 5e-3
    assert isinstance(certify_table(found.table, plant, 1e-2), CertifiedTable)


def test_formulas_that_may_not_be_defined():
    system = NonlinearSystem.of(lambda x, u: [u[0] / x[0]], ["x"], ["u"], 0.1)
    plant = ConstrainedSystem(system, Polytope.box([-1], [1]), Polytope.box([-1], [1]))
    found = certify_table(Table([[1.0], [0.0], [0.0]], [[0.0], [0.0]]), plant, 1e-9)
    assert isinstance(found, Unproved)
    assert "a divisor may be zero" in found.explanation


def answered(plant, off, tolerance, folder):
    """Return the answer about a table whose first state is off at some rows, and the content of its file."""
    table = followed(plant)
    states = table.states.copy()
    for row, by in off.items():
        states[row, 0] += by
    found = certify_table(replace(table, states=states), plant, tolerance)
    save = found.save_counterexample if off else found.save_certificate
    return found, json.loads(save(folder / "table.json").read_text())


ROBOT = ConstrainedSystem(robot(), Polytope.box([-3, -3, -7], [3, 3, 7]), Polytope.box([-1, -3], [2, 3]))


@pytest.mark.parametrize("off", [{}, {11: 1e-3}], ids=["kept", "broken"])
def test_a_flat_form_is_not_repeated_as_nothing_is_verified_of_it(off, tmp_path):
    """Once the statement had whatever form the file gave: "x" = 1e9 z1[0], and up to whole turns of nobody."""
    _, data = answered(ROBOT, off, 1e-6, tmp_path)
    verdict = check(data)
    assert isinstance(verdict, Refuted if off else Proved), verdict
    assert "z1" not in verdict.statement
    assert "whole turns" not in verdict.statement
    assert check(changed(data, "plant.system.flat.states.0", ["*", "z1[0]", 1e9])).statement == verdict.statement
    for part, put in (("angles", ["nobody"]), ("states", lambda all_: all_[:2]), ("inputs", lambda all_: all_ * 2)):
        assert_refused(data, f"plant.system.flat.{part}", put, "flat")


BROKEN = [
    ("at.violation", 1e-2, "is not shown to be broken by 0.01"),
    ("at.step", 99, "the table has no step 99"),
    ("at.index", 2, "no index 2 of the dynamics"),
    ("at.part", "states", "is not shown to be broken"),
    ("at.violation", -1.0, "must be"),
    ("tolerance", 1.0, "is not shown to be broken"),
]
KEPT = [
    ("table.states.7.0", float(np.nextafter(0.2, 1)), "bound 0 of the states is broken at step 11"),
    ("table.states.7.0", -0.2, "within the tolerance of the state after step 10"),
    ("table.states.29.0", float(np.nextafter(0.2, 1)), "bound 0 of the states is broken at step 33"),
    ("table.states.29.0", -0.2, "within the tolerance of the state after step 32"),
    ("table.inputs.29.0", 99.0, "bound 0 of the inputs is broken at step 33"),
    ("tolerance", 1e-18, "within the tolerance"),
    ("table.inputs", [[0.0]], "an input for each"),
    ("version", 2, "version 2"),
]


@pytest.mark.parametrize(
    ("plant", "off", "changes"), [(AXIS, {}, KEPT), (AXIS, {11: 1e-3}, BROKEN), (TANK, {11: 1e-3}, BROKEN)]
)
def test_what_is_changed_is_refused(plant, off, changes, tmp_path):
    _, data = answered(plant, off, 1e-6 if off else 1e-12, tmp_path)
    assert isinstance(check(data), Refuted if off else Proved)
    for change in changes:
        assert_refused(data, *change)


def assert_refused(data, path, put, reason):
    verdict = check(changed(data, path, put))
    assert isinstance(verdict, Failed | NotACertificate)
    assert reason in verdict.reason


def test_what_is_no_table_of_the_plant_is_refused():
    with pytest.raises(ValueError, match="expected 2 states and 1 inputs"):
        certify_table(Table(np.zeros((5, 1)), np.zeros((5, 1))), AXIS, 1.0)
