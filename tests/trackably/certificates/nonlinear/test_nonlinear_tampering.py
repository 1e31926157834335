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
from tests.trackably.checker.changes import PLANT, SYSTEM, changed, leaves
from trackably.certificates import cover, draft, prove
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove as prove_always
from trackably.checker import Failed, NotACertificate, Proved, check


def got(data: Any, path: tuple) -> Any:
    for key in path:
        data = data[key]
    return data


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
        for path in leaves(got(data, part), part):
            value = got(data, path)
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


put = changed


def _f(data: dict, f: Any) -> dict:
    return changed(data, (*SYSTEM, "f"), [f])


FREE = {"rows": [], "lower": [], "upper": [], "dimension": 1}


def _scaled(data: dict, path: tuple, factor: float) -> dict:
    return changed(data, path, factor * got(data, path))


LAW = ["+", "level", ["*", 0.05, ["-", "inflow", ["*", 0.6, ["sqrt", "level"]]]]]
TAMPERED = {
    "another constant": (lambda d: put(d, (*SYSTEM, "f", 0, 2, 2, 2, 1), 0.62), Failed, "box: the inflow"),
    "another function": (lambda d: put(d, (*SYSTEM, "f", 0, 2, 2, 2, 2, 0), "log"), Failed,
                         "(box|evaluation): the inflow"),
    "another law": (lambda d: _f(d, ["+", "level", "inflow"]), Failed, "evaluation|box"),
    "an input squared": (lambda d: _f(d, ["^", "inflow", 2.0]), Failed, "system: f is not affine in inflow"),
    "an input in a function": (lambda d: _f(d, ["exp", "inflow"]), Failed, "system: f is not affine"),
    "an input below": (lambda d: _f(d, ["/", "level", "inflow"]), Failed, "system: f is not affine"),
    "no input": (lambda d: _f(d, "level"), Failed, "system: f cannot be solved for inflow|system: f"),
    "an input that cancels": (
        lambda d: _f(d, ["-", ["+", "level", "inflow"], "inflow"]), Failed, "box: .* may be zero"),
    "an unknown name": (lambda d: _f(d, ["+", "inflow", "speed"]), Failed, "names: f must hold states and inputs"),
    "a state to come": (lambda d: _f(d, ["+", "inflow", "level⁺"]), NotACertificate, "must be a name"),
    "an unknown function": (lambda d: _f(d, ["tanh", "inflow"]), NotACertificate, "must be a formula"),
    "an operator for one": (lambda d: _f(d, ["+", "inflow"]), NotACertificate, "must be a formula"),
    "an exponent with a name": (lambda d: _f(d, ["^", "level", "inflow"]), NotACertificate, "must be a finite"),
    "two laws": (lambda d: put(d, (*SYSTEM, "f"), [LAW, LAW]), Failed, "shapes: as many formulas"),
    "no law": (lambda d: put(d, (*SYSTEM, "f"), []), NotACertificate, "must be a list, not empty"),
    "a matrix": (lambda d: put(d, (*SYSTEM, "A"), [[1.0]]), NotACertificate, "exactly the fields"),
    "trajectories": (lambda d: {**d, "trajectories": {}}, NotACertificate, "trajectories"),
    "a name twice": (lambda d: put(d, (*SYSTEM, "inputs"), ["level"]), Failed, "names: states and inputs must"),
    "a weight": (lambda d: _scaled(d, ("reference", "signals", 0, "weights", 0), 1.1), Failed, "box|evaluation"),
    "a bound": (lambda d: _scaled(d, (*PLANT, "input_set", "upper", 0), 0.98), Failed, "box: the inflow"),
    "a free input": (lambda d: put(d, (*PLANT, "input_set"), FREE), Failed, "bounds: every input .* inflow is not"),
    "no room": (lambda d: put(d, ("evaluation", "errors", "inflow"), 1e-16), Failed, "inflow .* can be off by more"),
    "an early tail": (
        lambda d: changed(put(d, ("claim", "tail_start"), 0.1), ("claim", "covers"),
                          {q: {"ends": [0.0, 0.1], "radii": [0.5]} for q in ("level", "inflow")}), Failed, "tail"),
}  # fmt: skip


@pytest.mark.parametrize("what", TAMPERED)
def test_tampered_certificates_are_refused(what):
    change, kind, reason = TAMPERED[what]
    verdict = check(change(as_read(proved("tank"))))
    assert isinstance(verdict, kind), verdict
    assert re.search(reason, verdict.reason), verdict.reason
