"""Whatever is changed in a certificate, the checker refuses it or its statement is still true."""

import json
from collections.abc import Callable
from functools import partial
from itertools import islice
from typing import Any

import pytest

from tests.attack.truth import is_kept, is_kept_by_formulas
from tests.trackably.certificates.nonlinear.instances import as_read, tight
from tests.trackably.checker.changes import tampered
from tests.trackably.checker.pieces import instances as pieces
from tests.trackably.checker.tight import VALID
from trackably.certificates import cover, draft
from trackably.certificates import prove as prove_module
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
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


KINDS: dict[str, tuple[Callable[[], dict], Callable[[dict], bool], int]] = {
    **{kind: (lambda make=make: encode_certificate(make()), is_kept, 10) for kind, make in VALID.items()},
    **{beyond: (partial(pieces.certificate, beyond), is_kept, 8) for beyond in ("rest", "period", "end")},
    "formulas": (lambda: as_read(prove(tight("tank", centres=2))), is_kept_by_formulas, 12),
}
"""What makes a certificate, whether what it says is true, and of how many changes one is tried."""


@pytest.mark.usefixtures("remembered")
@pytest.mark.parametrize("kind", KINDS)
def test_no_change_makes_it_prove_what_is_false(kind):
    make, is_true, every = KINDS[kind]
    data = json.loads(json.dumps(make()))
    assert isinstance(check(data), Proved)
    verdicts, proved = [], 0
    for i, (what, other) in enumerate(islice(tampered(data), 0, None, every)):  # `make attack` goes on for longer
        verdict = check(other, exact=i % 4 > 0)  # most in mpmath: what it has enclosed is remembered
        verdicts.append(type(verdict))
        if isinstance(verdict, Proved):
            proved += 1
            assert is_true(other), what
    assert 10 < proved < 0.35 * len(verdicts)
    assert NotACertificate in verdicts
