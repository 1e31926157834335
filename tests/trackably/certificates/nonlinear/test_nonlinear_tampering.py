"""Changed certificates of nonlinear systems are refused, or still true."""

import re
from collections import Counter
from typing import Any

import numpy as np
import pytest

from tests.trackably.certificates.decoded import decode_certificate
from tests.trackably.certificates.nonlinear.instances import (
    as_read,
    proved,
    tight,
)
from tests.trackably.checker.changes import PLANT, SYSTEM, changed, leaves, part_at
from trackably.certificates import cover, draft, prove
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove as prove_always
from trackably.checker import Failed, NotACertificate, Proved, check


def _is_true(data: dict) -> bool:
    """By a dense look at what the changed certificate says, whatever the proof in it."""
    certificate = decode_certificate(data)
    reference, times = certificate.reference, np.linspace(0.0, 5.0, 20_001)
    return all(
        float(np.min(q.margin(reference.signals, times))) >= 0.99 * certificate.evaluation_error[q.name]
        for q in reference.quantities
    )


def test_no_change_of_the_system_or_the_reference_makes_it_prove_what_is_false(monkeypatch):
    """Short Taylor polynomials: hundreds of certificates are to be checked."""
    for module in (cover, draft, prove):
        monkeypatch.setattr(module, "TERMS", 8)
    found = prove_always(tight("tank", centres=2))
    assert isinstance(found, Certificate)
    data = as_read(found)
    parts = [("reference",), ("evaluation",)]
    seen: Counter[type] = Counter()
    for part in parts:
        for path in leaves(part_at(data, part), part):
            value = part_at(data, path)
            if isinstance(value, float | int):
                news: list[Any] = [value * 1.01 + 1e-3, value * 0.99 - 1e-3, str(value)]
            elif isinstance(value, str):
                news = ["level", "inflow", "-", ""]
            else:
                news = [[], value[::-1]] if isinstance(value, list) else [{}]
            for new in news:
                if new == value and type(new) is type(value):
                    continue
                verdict = check(other := changed(data, path, new))
                seen[type(verdict)] += 1
                assert not isinstance(verdict, Proved) or _is_true(other), (path, new)
    assert seen[NotACertificate] > 30
    assert seen[Failed] > 30


F = (*SYSTEM, "f")
LAW = ["+", "level", ["*", 0.05, ["-", "inflow", ["*", 0.6, ["sqrt", "level"]]]]]
FREE = {"rows": [], "lower": [], "upper": [], "dimension": 1}
SHORT = {"ends": [0.0, 0.1], "radii": [0.5]}
EARLY = {"kind": "all_times", "tail_start": 0.1, "covers": {"level": SHORT, "inflow": SHORT}, "terms": 16}
TAMPERED = {
    "another function": ((*F, 0, 2, 2, 2, 2, 0), "log", Failed, "(box|evaluation): the inflow"),
    "another law": ((*F, 0), ["+", "level", "inflow"], Failed, "evaluation|box"),
    "an input squared": ((*F, 0), ["^", "inflow", 2.0], Failed, "system: f is not affine in inflow"),
    "an input in a function": ((*F, 0), ["exp", "inflow"], Failed, "system: f is not affine"),
    "an input below": ((*F, 0), ["/", "level", "inflow"], Failed, "system: f is not affine"),
    "no input": ((*F, 0), "level", Failed, "system: f cannot be solved for its inputs"),
    "an input that cancels": ((*F, 0), ["-", ["+", "level", "inflow"], "inflow"], Failed, "box: .* may be zero"),
    "an unknown name": ((*F, 0), ["+", "inflow", "speed"], Failed, "names: f must hold states and inputs"),
    "a state to come": ((*F, 0), ["+", "inflow", "level⁺"], NotACertificate, "must be a name"),
    "an unknown function": ((*F, 0), ["tanh", "inflow"], NotACertificate, "must be a formula"),
    "an operator for one": ((*F, 0), ["+", "inflow"], NotACertificate, "must be a formula"),
    "an exponent with a name": ((*F, 0), ["^", "level", "inflow"], NotACertificate, "must be a finite"),
    "two laws": (F, [LAW, LAW], Failed, "shapes: as many formulas"),
    "no law": (F, [], NotACertificate, "must be a list, not empty"),
    "a matrix": ((*SYSTEM, "A"), [[1.0]], NotACertificate, "exactly the fields"),
    "trajectories": (("trajectories",), {}, NotACertificate, "trajectories"),
    "a name twice": ((*SYSTEM, "inputs"), ["level"], Failed, "names: states and inputs must"),
    "a free input": ((*PLANT, "input_set"), FREE, Failed, "bounds: every input .* inflow is not"),
    "no room": (("evaluation", "errors", "inflow"), 1e-16, Failed, "inflow .* can be off by more"),
    "an early tail": (("claim",), EARLY, Failed, "tail"),
}


@pytest.mark.parametrize("what", TAMPERED)
def test_tampered_certificates_are_refused(what):
    path, value, kind, reason = TAMPERED[what]
    verdict = check(changed(as_read(proved("tank")), path, value))
    assert isinstance(verdict, kind), verdict
    assert re.search(reason, verdict.reason), verdict.reason
