"""Whatever is changed in a certificate, the checker refuses it or its statement is still true."""

from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import pytest

from tests.trackable.certificates import naive
from tests.trackable.checker.changes import PLANT, changed, tampered
from tests.trackable.checker.test_soundness import smallest_margin
from tests.trackable.checker.tight import VALID
from trackable.certificates import cover
from trackable.certificates import prove as prove_module
from trackable.checker import NotACertificate, Proved, check
from trackable.checker.arithmetic.models import Model
from trackable.checker.steps import boxes, enclosures
from trackable.codec.certificates import decode_certificate, encode_certificate
from trackable.systems.flat.flatness import Flatness
from trackable.systems.flat.functional import Functional
from trackable.systems.reference import Reference


@cache
def _is_true(statement: str) -> bool:
    """Whether what the certificate says is true, by a dense search that looks at no box."""
    data = eval(statement)
    certificate = decode_certificate(data)
    reference = as_stored(certificate.reference, data["trajectories"])
    errors = data["evaluation"]["errors"]
    return naive.follows_exactly(reference) and all(
        smallest_margin(reference, certificate.claim, quantity.name) >= errors[quantity.name]
        for quantity in reference.quantities
    )


def as_stored(reference: Reference, trajectories: dict) -> Reference:
    """With the trajectories of a file, whatever the system's own are."""

    def functionals(parts: list) -> tuple[Functional, ...]:
        t_s = reference.plant.sampling_time
        return tuple(
            Functional(tuple(tuple(map(Fraction, w)) for w in q["weights"]), Fraction(q["offset"]), t_s) for q in parts
        )

    states, inputs = functionals(trajectories["states"]), functionals(trajectories["inputs"])
    plant = replace(reference.plant)
    plant.__dict__["flatness"] = Flatness(states, inputs, tuple(len(w) for w in inputs[0].weights))
    return Reference(reference.signals, plant)


def statement(data: dict) -> str:
    """All that the statement depends on: everything but the boxes."""
    claim = {key: value for key, value in data["claim"].items() if key not in {"covers", "terms"}}
    return repr({**data, "claim": claim})


@pytest.fixture(autouse=True)
def few_terms(monkeypatch):
    """Short Taylor polynomials: a thousand certificates are to be checked."""
    monkeypatch.setattr(cover, "TERMS", 8)
    monkeypatch.setattr(prove_module, "TERMS", 8)


@pytest.fixture
def remembered(monkeypatch):
    """One change leaves nearly all boxes and signals as they were: what is enclosed in them is the same, and so is
    whether a polynomial is positive. Both are told apart by all that they depend on, to the last bit."""
    models: dict[Any, Model] = {}
    signs: dict[Any, bool] = {}
    enclose_signal, is_positive = enclosures.enclose_signal, boxes.is_positive

    def enclosed(signal: Any, shift: Any, box: Any, n: int) -> Model:
        asked = repr((signal, shift._mpi_, box, n))
        if asked not in models:
            models[asked] = enclose_signal(signal, shift, box, n)
        return models[asked]

    def positive(coefficients: list) -> bool:
        asked = tuple(coefficient._mpi_ for coefficient in coefficients)
        if asked not in signs:
            signs[asked] = is_positive(coefficients)
        return signs[asked]

    monkeypatch.setattr(enclosures, "enclose_signal", enclosed)
    monkeypatch.setattr(boxes, "is_positive", positive)


@pytest.mark.usefixtures("remembered")
@pytest.mark.parametrize("kind", VALID)
def test_no_change_makes_it_prove_what_is_false(kind):
    data = encode_certificate(VALID[kind]())
    assert isinstance(check(data), Proved)
    verdicts, proved = [], 0
    for what, other in tampered(data):
        verdict = check(other)
        verdicts.append(type(verdict))
        if isinstance(verdict, Proved):
            proved += 1
            assert _is_true(statement(other)), what
    assert proved < 0.35 * len(verdicts)
    assert NotACertificate in verdicts


@pytest.mark.parametrize("kind", VALID)
def test_bounds_drawn_in_across_the_reference_are_not_proved(kind):
    """A thousandth of the width is all the room there is."""
    data = encode_certificate(VALID[kind]())
    examined = 0
    for side in ("state_set", "input_set"):
        bounds = data["reference"]["plant"][side]
        for i, (low, high) in enumerate(zip(bounds["lower"], bounds["upper"], strict=True)):
            by, narrow = 5e-3 * (high - low), data
            for end, value in (("lower", low + by), ("upper", high - by)):
                narrow = changed(narrow, (*PLANT, side, end, i), value)
            assert not isinstance(check(narrow), Proved)
            examined += 1
    assert examined >= 2
