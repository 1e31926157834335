"""Whatever is changed in a certificate, the checker refuses it or its statement is still true."""

from itertools import islice
from typing import Any

import pytest

from tests.trackably.checker.changes import PLANT, changed, tampered
from tests.trackably.checker.tight import VALID
from tests.trackably.checker.truth import is_true, statement
from trackably.certificates import cover, draft
from trackably.certificates import prove as prove_module
from trackably.certificates.form import encode_certificate
from trackably.checker import NotACertificate, Proved, boxes, check
from trackably.checker.models import Model


@pytest.fixture(autouse=True)
def few_terms(monkeypatch):
    """Short Taylor polynomials: a thousand certificates are to be checked."""
    for module in (cover, draft, prove_module):
        monkeypatch.setattr(module, "TERMS", 8)


@pytest.fixture
def remembered(monkeypatch):
    """One change leaves nearly all boxes and signals as they were: what is enclosed in them is the same, and so is
    whether a polynomial is positive. Both are told apart by all that they depend on, to the last bit."""
    models: dict[Any, Model] = {}
    signs: dict[Any, bool] = {}
    enclose_signal, is_nowhere_negative = boxes.enclose_signal, boxes.is_nowhere_negative

    def enclosed(signal: Any, shift: Any, box: Any, n: int) -> Model:
        asked = repr((signal, shift._mpi_, box, n))
        if asked not in models:
            models[asked] = enclose_signal(signal, shift, box, n)
        return models[asked]

    def positive(coefficients: list[int]) -> bool:
        asked = tuple(coefficients)
        if asked not in signs:
            signs[asked] = is_nowhere_negative(coefficients)
        return signs[asked]

    monkeypatch.setattr(boxes, "enclose_signal", enclosed)
    monkeypatch.setattr(boxes, "is_nowhere_negative", positive)


@pytest.mark.usefixtures("remembered")
@pytest.mark.parametrize("kind", VALID)
def test_no_change_makes_it_prove_what_is_false(kind):
    data = encode_certificate(VALID[kind]())
    assert isinstance(check(data), Proved)
    verdicts, proved = [], 0
    for i, (what, other) in enumerate(islice(tampered(data), 0, None, 8)):  # `make attack` goes on for longer
        verdict = check(other, exact=i % 4 > 0)  # most in mpmath: what it has enclosed is remembered
        verdicts.append(type(verdict))
        if isinstance(verdict, Proved):
            proved += 1
            assert is_true(statement(other)), what
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
