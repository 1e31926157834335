"""Faults planted in the prover: it then issues false certificates, and the checker, which shares nothing, says so."""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb

from pipeline.certificates import cover, enclosure, exact, prove, settled
from pipeline.certificates.certificate import Certificate
from pipeline.certificates.checker import Failed, check
from pipeline.certificates.cover import Cover
from pipeline.gp.radial import Matern32, SquaredExponential
from pipeline.gp.signal import KernelSum
from pipeline.systems.interval import Interval
from pipeline.systems.reference import Reference
from pipeline.systems.scalar import ConstrainedSystem, ScalarLinear
from tests.certificates.references import certified, unconstrained


def small(kernel, state_set=(-2.0, 2.0), input_set=(-2.0, 2.0)) -> Reference:
    plant = ConstrainedSystem(ScalarLinear(0.9, 0.5), Interval(*state_set), Interval(*input_set), 0.05)
    return Reference(KernelSum(kernel, 0.0, np.array([0.0, 0.4, 0.9]), np.array([0.5, -0.8, 0.3])), plant)


def assert_caught(reference: Reference, *reasons: str) -> None:
    found = prove.prove(reference)
    assert isinstance(found, Certificate), found.explanation
    verdict = check(found.to_dict())
    assert isinstance(verdict, Failed), verdict
    assert verdict.reason.startswith(reasons), verdict.reason


@pytest.fixture(params=["example1", "example2"], scope="module")
def learned(request) -> Reference:
    """Made before anything is planted."""
    return certified(request.param).reference


@pytest.fixture(params=["example1", "example2"], scope="module")
def broken(request) -> Reference:
    return unconstrained(request.param)


@pytest.fixture
def blind(monkeypatch):
    """The search for a counterexample finds nothing."""
    monkeypatch.setattr(prove._Task, "_failure_at", lambda *_: None)


def test_a_prover_that_believes_every_box(broken, monkeypatch, blind):
    monkeypatch.setattr(enclosure.Enclosure, "stays_in", lambda *_: True)
    monkeypatch.setattr(cover, "remainder", lambda *_: arb(0))
    monkeypatch.setattr(cover.Sketch, "smallest", lambda *_: 1.0)
    assert_caught(broken, "box")


def test_a_prover_that_forgets_the_remainder(monkeypatch, blind):
    monkeypatch.setattr(cover, "remainder", lambda *_: arb(0))
    monkeypatch.setattr(enclosure, "remainder", lambda *_: arb(0))
    monkeypatch.setattr(cover, "TERMS", 2)
    monkeypatch.setattr(prove, "TERMS", 2)
    assert_caught(small(SquaredExponential(1.0, 0.3)), "box")


def test_a_prover_with_a_wrong_kernel(monkeypatch, blind):
    right = enclosure.taylor
    monkeypatch.setattr(enclosure, "taylor", lambda kernel, r: right(replace(kernel, signal_std=0.5), r))
    monkeypatch.setattr(cover.Sketch, "smallest", lambda *_: 1.0)
    assert_caught(small(SquaredExponential(1.0, 0.3), state_set=(-0.4, 0.3)), "box")


def test_a_prover_that_overlooks_kinks(monkeypatch, blind):
    monkeypatch.setattr(enclosure, "is_analytic", lambda _: True)
    assert_caught(small(Matern32(1.0, 0.3), state_set=(-0.71, 0.34)), "box")


def test_a_prover_whose_cover_ends_too_early(learned, monkeypatch, blind):
    right = prove.cover

    def shortened(*arguments):
        found = right(*arguments)
        return Cover(found.ends[:-1], found.radii[:-1])

    monkeypatch.setattr(prove, "cover", shortened)
    assert_caught(learned, "cover")


def test_a_prover_whose_cover_has_a_hole(learned, monkeypatch, blind):
    right = prove.cover

    def holed(*arguments):
        found = right(*arguments)
        return Cover((found.ends[0], *found.ends[2:]), found.radii[1:])

    monkeypatch.setattr(prove, "cover", holed)
    assert_caught(learned, "box")


def test_a_prover_that_settles_too_early(monkeypatch, blind):
    monkeypatch.setattr(settled, "float_below", lambda _: 1.0)
    assert_caught(small(SquaredExponential(1.0, 0.3), state_set=(-2.0, 0.45)), "tail")


def test_a_prover_that_forgets_rounding(monkeypatch):
    tiny = {"state": 1e-300, "input": 1e-300}
    monkeypatch.setattr(prove, "evaluation_errors", lambda *_: tiny)
    assert_caught(small(SquaredExponential(1.0, 0.3)), "evaluation")


def test_a_prover_that_takes_any_length_scale_for_a_period(monkeypatch, blind):
    monkeypatch.setattr(prove, "common_period", lambda _: 1.0)
    assert_caught(small(SquaredExponential(1.0, 0.3)), "period")


def test_a_prover_with_a_wrong_sign_in_the_system(monkeypatch, blind):
    """As if x⁺ = −a x + b u: the true input is half as large again, or more."""
    right = exact.exact_quantities

    def mistaken(reference):
        state, inputs = right(reference)
        (w, s), (v, zero) = inputs.terms
        return state, replace(inputs, terms=((w, s), (-v, zero)))

    monkeypatch.setattr(prove, "exact_quantities", mistaken)
    wide = small(SquaredExponential(1.0, 3.0), input_set=(-0.05, 0.05), state_set=(-1.0, 1.0))
    other = replace(wide, plant=replace(wide.plant, system=ScalarLinear(-0.9, 0.5)))
    monkeypatch.setattr(cover.Sketch, "smallest", lambda *_: 1.0)
    monkeypatch.setattr(settled, "float_below", lambda _: 1.0)
    assert_caught(replace(other, plant=replace(other.plant, input_set=Interval(-0.2, 0.2))), "box", "tail")
