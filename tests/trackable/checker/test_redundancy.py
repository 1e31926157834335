"""Certificates of systems with redundant inputs: proved, read again, and refused where a bound leaves too much."""

import copy
import json
import math
from dataclasses import replace
from fractions import Fraction
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.trackable.gp.instances import over
from tests.trackable.systems.instances import controllable
from tests.trackable.systems.redundant_instances import CASES, ONE_STATE, excess
from trackable.certificates.certificate import Certificate
from trackable.certificates.outcome import Counterexample
from trackable.certificates.prove import prove
from trackable.checker import Failed, NotACertificate, Proved, check
from trackable.checker.certificate import Row
from trackable.checker.reading.certificates import read_certificate
from trackable.checker.steps.redundancy import why_not_attainable
from trackable.codec.certificates import decode_certificate, encode_certificate
from trackable.gp.kernels.matern import Matern52
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.samples import Samples
from trackable.gp.signal import KernelSum
from trackable.learn import learn_reference
from trackable.reference import TrackableReference
from trackable.systems.allocation import Allocation
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.linear import LinearSystem
from trackable.systems.reference import Reference
from trackable.systems.sets.polytope import Polytope

STEPS = np.arange(5000)
PLANT = ConstrainedSystem(ONE_STATE, Polytope.box([-3.0], [3.0]), Polytope.box([-1.0, -0.2], [1.0, 0.2]))
AXES = LinearSystem.discretised(
    np.kron(np.eye(2), np.array([[0.0, 1.0], [0.0, -0.5]])), np.eye(4)[:, 1::2], 0.1, states=("x", "vx", "y", "vy")
)
PLANE = ConstrainedSystem(
    LinearSystem(
        AXES.A,
        AXES.B @ np.array([[1.0, 0, 1, -1], [0, 1, 1, 1]]),
        AXES.c,
        AXES.states,
        ("east", "north", "ne", "nw"),
        sampling_time=0.1,
    ),
    Polytope.box(-2 * np.ones(4), 2 * np.ones(4)),
    Polytope.box(np.array([-0.2, -0.1, -0.3, -0.15]), np.array([0.2, 0.1, 0.3, 0.15])),
)


@cache
def learned() -> TrackableReference:
    """It needs more than the second of two equal inputs can give."""
    times = np.linspace(0, 8, 25)
    values = 2 * np.exp(-((times - 4) ** 2) / 4) + 0.05 * np.random.default_rng(1).normal(size=25)
    kernel = SquaredExponential()
    return learn_reference(Samples(times, values), PLANT, kernel, "all_times", noise_std=0.05, progress=False)


@cache
def in_the_plane() -> Certificate:
    signals = (
        KernelSum(SquaredExponential(1.0, 1.5), 0.0, np.array([0.0, 2.0]), np.array([0.6, -0.7])),
        KernelSum(SquaredExponential(1.0, 2.0), 0.1, np.array([1.0]), np.array([-0.6])),
    )
    found = prove(Reference(signals, PLANE))
    assert isinstance(found, Certificate)
    return found


def as_read(certificate: Certificate) -> dict[str, Any]:
    return json.loads(json.dumps(encode_certificate(certificate)))


def test_what_the_smallest_input_of_all_could_not_do_is_followed_all_the_same():
    found = learned()
    least = np.stack([q(found.reference.signals, STEPS * 0.1) for q in PLANT.flatness.inputs], axis=-1)
    assert np.min(PLANT.input_set.margin(least)) < -0.2
    assert np.min(PLANT.input_set.margin(found.input(STEPS))) > -1e-14
    landed = PLANT.system.successor(found.state(STEPS), found.input(STEPS))
    np.testing.assert_allclose(landed, found.state(STEPS + 1), atol=1e-13)


def test_the_checker_proves_that_inputs_exist():
    for certificate in (learned().certificate, in_the_plane()):
        verdict = check(as_read(certificate))
        assert isinstance(verdict, Proved), verdict
        assert "inputs that push alike" in verdict.statement
    assert "-1.0 ≤ u1 ≤ 1.0, -0.2 ≤ u2 ≤ 0.2" in check(as_read(learned().certificate)).statement
    assert "u1+u2 in [-1.2, 1.2]" in learned().explanation


def test_in_the_plane_several_rows_are_needed():
    assert len(as_read(in_the_plane())["attainable"]) == 4
    reference = in_the_plane().reference
    least = np.stack([q(reference.signals, STEPS * 0.1) for q in PLANE.flatness.inputs], axis=-1)
    assert np.min(PLANE.input_set.margin(least)) < -0.01
    assert np.min(PLANE.input_set.margin(reference.input(STEPS))) > -1e-14


def test_a_certificate_is_read_as_it_was_written(tmp_path):
    for certificate in (learned().certificate, in_the_plane()):
        assert encode_certificate(decode_certificate(as_read(certificate))) == encode_certificate(certificate)
    learned().save(tmp_path / "reference.json")
    again = TrackableReference.load(tmp_path / "reference.json")
    np.testing.assert_array_equal(again.input(STEPS[:100]), learned().input(STEPS[:100]))


def test_the_standard_deviation_is_that_of_the_inputs_that_are_left():
    """Where the second input is at its bound, the first does everything; elsewhere both do half."""
    found, k = learned(), STEPS[:80]
    u, std = found.input(k), found.input_std(k)
    at_bound = np.abs(u[:, 1]) > 0.2 - 1e-12
    assert 10 < np.sum(at_bound) < 50
    np.testing.assert_array_equal(std[at_bound, 1], 0)
    np.testing.assert_allclose(std[~at_bound, 0], std[~at_bound, 1], rtol=1e-9)
    alone = ConstrainedSystem(
        LinearSystem(np.array([[0.5]]), np.array([[1.0]]), sampling_time=0.1),
        PLANT.state_set,
        Polytope.box([-2.0], [2.0]),
    )
    single = replace(found, reference=Reference(found.reference.signals, alone))
    np.testing.assert_allclose(std[at_bound, 0], single.input_std(k[at_bound])[:, 0], rtol=1e-9)


def changed(data: dict[str, Any], place: tuple[Any, ...], value: Any) -> dict[str, Any]:
    data = copy.deepcopy(data)
    inner = data
    for step in place[:-1]:
        inner = inner[step]
    inner[place[-1]] = value
    return data


TAMPERED: dict[str, tuple[tuple[Any, ...], Any, str]] = {
    "second input narrower": (("reference", "plant", "input_set", "upper", 1), 0.19, "input_set"),
    "first input narrower": (("reference", "plant", "input_set", "lower", 0), -0.99, "input_set"),
    "second input of another size": (("reference", "plant", "input_set", "rows", 1), [0.0, 1.5], "input_set"),
    "a row more": (("reference", "plant", "input_set", "rows", 1), [1.0, 1.0], "input_set"),
    "bounds exchanged": (("reference", "plant", "input_set", "lower", 1), 0.3, "input_set"),
    "a row too long": (("reference", "plant", "input_set", "rows", 0), [1.0, 0.0, 0.0], "shapes"),
    "bound wider": (("attainable", 0, "upper"), 1.21, "input_set"),
    "bound on something else": (("attainable", 0, "row"), ["1", "2"], "names"),
    "a row that is too short": (("attainable", 0, "row"), ["1"], "shapes"),
    "no attainable rows": (("attainable",), [], "a list, not empty"),
    "other inputs": (("reference", "plant", "system", "B"), [[1.0, 1.5]], "trajectories"),
}


@over(TAMPERED, "change")
def test_a_bound_that_leaves_too_much_is_refused(change):
    place, value, step = change
    verdict = check(changed(as_read(learned().certificate), place, value))
    if step == "a list, not empty":
        assert isinstance(verdict, NotACertificate)
        assert step in verdict.reason
    else:
        assert isinstance(verdict, Failed)
        assert verdict.reason.startswith(step)


def test_rows_that_are_left_out_are_missed():
    """Without attainable rows the input set's own rows are bounds: those of other names."""
    data = as_read(learned().certificate)
    del data["attainable"]
    verdict = check(data)
    assert isinstance(verdict, Failed)
    assert verdict.reason.startswith("names")


@over({"float row": [1.0, 1.0], "decimal": ["0.5", "1"], "nan": [math.nan, 1.0]}, "row")
def test_rows_of_redundant_inputs_are_exact(row):
    assert isinstance(check(changed(as_read(learned().certificate), ("attainable", 0, "row"), row)), NotACertificate)


def test_the_same_row_in_another_size_or_direction_says_the_same():
    certificate = read_certificate(as_read(learned().certificate))
    rows, (bound,) = certificate.input_set.rows, certificate.attainable
    for factor in (2, -1, -4):
        lower, upper = sorted(factor * end for end in (bound.lower, bound.upper))
        turned = Row(tuple(factor * r for r in bound.row), lower, upper)
        assert why_not_attainable(certificate.system, rows, (turned,)) is None
        for wider in (replace(turned, lower=lower - 1e-12), replace(turned, upper=upper + 1e-12)):
            assert why_not_attainable(certificate.system, rows, (wider,)) is not None


EMPTY = {
    "nothing in between": [([0.0, 0.0], 1.0, 2.0)],
    "apart": [([1.0, 0.0], 1.0, 2.0), ([1.0, 0.0], -5.0, -0.2)],
    "apart in other units": [([1.0, 0.0], 1.0, 2.0), ([-3.0, 0.0], 1.0, 2.0)],
    "apart beside another": [([1.0, 0.0], -0.1, 5.0), ([1.0, 0.0], -5.0, -0.2), ([0.0, 1.0], -9.0, 9.0)],
}


@over(EMPTY, "rows")
def test_an_empty_set_holds_no_input(rows):
    """Each has no inequality left that says anything of u; those that say nothing of it must hold."""
    certificate = read_certificate(as_read(learned().certificate))
    sides = tuple(row_of(*row) for row in rows)
    reason = why_not_attainable(certificate.system, sides, certificate.attainable)
    assert reason is not None
    assert reason.startswith("input_set: no input keeps its rows")
    columns = zip(("rows", "lower", "upper"), map(list, zip(*rows, strict=True)), strict=True)
    other = {**dict(columns), "dimension": 2}
    assert isinstance(
        check(changed(as_read(learned().certificate), ("reference", "plant", "input_set"), other)), Failed
    )


def test_a_set_turned_inside_out_holds_no_input():
    certificate = read_certificate(as_read(learned().certificate))
    side, bound = row_of([0.0, 1.0], 0.2, -0.2), row_of([1.0, 1.0], -0.5, 0.5)
    reason = why_not_attainable(certificate.system, (certificate.input_set.rows[0], side), (bound,))
    assert reason == "input_set: every row needs a number for each input, and lower ≤ upper"


def row_of(row, lower: float, upper: float) -> Row:
    return Row(tuple(map(Fraction, row)), lower, upper)


@over(CASES, "case")
def test_both_implementations_find_the_same_rows(case):
    """The checker wants every row that the prover bounds, to the last bit, and no more."""
    system, wanted = case
    attainable = tuple(row_of(r, b.lower, b.upper) for r, b in Allocation.of(system, wanted).attainable)
    rows = tuple(row_of(r.tolist(), b.lower, b.upper) for r, b in wanted.intervals)
    checked = SimpleNamespace(inputs=system.inputs, B=system.B.tolist())
    assert why_not_attainable(checked, rows, attainable) is None
    for i, bound in enumerate(attainable):
        others = attainable[:i] + attainable[i + 1 :]
        wider = (
            replace(bound, upper=bound.upper * (1 + 1e-15) + 1e-15),
            replace(bound, lower=bound.lower - 1e-12),
        )
        for one in wider:
            assert why_not_attainable(checked, rows, (*others, one)) is not None
        assert why_not_attainable(checked, rows, others) is not None


def test_a_scalar_input_needs_no_set_of_its_own():
    scalar = replace(
        PLANT,
        system=LinearSystem(np.array([[0.5]]), np.array([[1.0]]), sampling_time=0.1),
        input_set=Polytope.box([-1.2], [1.2]),
    )
    found = prove(Reference(learned().reference.signals, scalar))
    assert isinstance(found, Certificate)
    assert "attainable" not in encode_certificate(found)


def nearly(seed: int) -> tuple[Reference, float]:
    """A random reference of a system with an input too many, and the part of U by which some need is kept or broken."""
    rng = np.random.default_rng(seed)
    system = controllable(3 * seed, states=2)
    n, m = system.A.shape[0], min(system.B.shape[1], len(system.A)) + 1
    system = LinearSystem(
        system.A, np.column_stack([system.B[:, : m - 1], rng.choice([-1, 0.5, 2]) * system.B[:, 0]]), sampling_time=0.1
    )
    lower, upper = -rng.uniform(0.1, 2, m), rng.uniform(0.1, 2, m)
    free = Polytope(np.empty((0, n)), np.empty(0), np.empty(0), n)
    kernels = (SquaredExponential(1.0, 0.7), Matern52(1.0, 1.0))
    plant = ConstrainedSystem(system, free, Polytope.box(lower, upper))
    signals = tuple(
        KernelSum(kernels[int(rng.integers(2))], 0.0, np.sort(rng.uniform(0, 2, 3)), rng.normal(size=3))
        for _ in range(plant.signal_count)
    )
    reference = Reference(signals, plant)
    used = max(
        float(np.max(np.abs(values / np.where(values < 0, quantity.bounds.lower, quantity.bounds.upper))))
        for quantity in reference.quantities
        for values in [quantity(signals, FINE)]
    )
    off = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-6, -2))
    bounds = Polytope.box((1 + off) * used * lower, (1 + off) * used * upper)
    return Reference(signals, replace(plant, input_set=bounds)), off


FINE = np.linspace(0, 12, 24_001)


@pytest.mark.parametrize("seed", range(24))
def test_what_is_proved_can_be_done_and_what_is_denied_cannot(seed):
    """By linear programs at the tightest times; a hair (of 1e-6 at least) decides."""
    reference, off = nearly(seed)
    plant, outcome = reference.plant, prove(reference)
    needs = np.min([quantity.margin(reference.signals, FINE) for quantity in reference.quantities], axis=0)
    least = np.stack([q(reference.signals, FINE) for q in plant.flatness.inputs], axis=-1)
    tightest = np.argsort(needs)[:20]
    excesses = [excess(plant.system, plant.input_set, least[i]) for i in tightest]
    if isinstance(outcome, Certificate):
        assert off > 0
        assert max(excesses) < 1e-9
        assert np.min(plant.input_set.margin(reference.input_at(FINE))) > -1e-12
        assert isinstance(check(as_read(outcome)), Proved)
    else:
        assert isinstance(outcome, Counterexample)
        assert off < 0
        assert max(excesses) > 0
