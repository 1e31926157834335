"""The statement says of which reference: by a fingerprint, the span of its kernels, and its states at time zero."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.trackable.certificates.nonlinear.instances import proved
from tests.trackable.certificates.test_prove import reference
from tests.trackable.checker.instances import changed, scalar_certificate
from tests.trackable.checker.redundant import in_the_plane, learned
from tests.trackable.checker.tight import VALID
from trackable import checker
from trackable.certificates.certificate import Certificate
from trackable.certificates.prove import prove
from trackable.checker import Proved, check
from trackable.checker.arithmetic.intervals import between, exactly
from trackable.codec.certificates import encode_certificate
from trackable.codec.fingerprint import fingerprint
from trackable.gp.kernels.squared_exponential import SquaredExponential

KINDS = {**VALID, "nonlinear": lambda: proved("tank"), "redundant inputs": in_the_plane}


def said(data: dict) -> str:
    verdict = check(json.loads(json.dumps(data)))
    assert isinstance(verdict, Proved), verdict
    return verdict.statement


def sha(statement: str) -> str:
    return re.search(r"SHA-256 ([0-9a-f]{64})\b", statement)[1]


@pytest.mark.parametrize("kind", KINDS)
def test_prover_and_checker_find_the_same_fingerprint_and_start(kind: str) -> None:
    certificate = KINDS[kind]()
    statement = said(encode_certificate(certificate))
    assert sha(statement) == fingerprint(certificate.reference)
    system, start = certificate.reference.plant.system, certificate.reference.state_at(np.zeros(()))
    for name, value in zip(system.states, start, strict=True):
        printed = re.search(rf'"{re.escape(name)}" = (\S+?)(,| at t = 0 s)', statement)[1]
        assert float(printed) == pytest.approx(value, rel=1e-5, abs=1e-9)
    assert "by sums of products" in statement


def test_a_learned_reference_shows_the_same() -> None:
    found = learned()
    statement = said(encode_certificate(found.certificate))
    assert found.fingerprint == sha(statement)
    assert found.identity in repr(found)
    assert found.identity.replace("x1 =", '"x1" =').split(", ", 1)[1].startswith("25 kernels centred from 0 s to 8 s")
    assert f"SHA-256 {found.fingerprint}, 25 kernels" in found.identity


def test_digits_that_float64_does_not_determine_are_asked_of_mpmath(monkeypatch: pytest.MonkeyPatch) -> None:
    data = scalar_certificate()
    known = said(data)
    for near in (None, between(-1, 1)):
        quick = replace(checker.FIRST_PASS, at_zero=lambda *_, near=near: near)
        monkeypatch.setattr(checker, "FIRST_PASS", quick)
        assert said(data) == known
    monkeypatch.setattr(checker, "FIRST_PASS", replace(checker.FIRST_PASS, at_zero=lambda *_: exactly(0.5)))
    assert '"state" = 0.5 at t = 0 s' in said(data) != known


def test_all_zero_weights_are_seen() -> None:
    """Once the same sentence came for a reference that rests at its mean."""
    data = scalar_certificate()
    rests = changed(data, "reference.signals.0.weights", [0.0] * len(data["reference"]["signals"][0]["weights"]))
    assert "no kernel at all" in said(rests)
    assert f'"state" = {data["reference"]["signals"][0]["mean"]:.6g} at t = 0 s' in said(rests)
    assert sha(said(rests)) != sha(said(data))


def test_every_number_of_the_reference_counts_and_nothing_else_does() -> None:
    data = scalar_certificate()
    wider = changed(data, "reference.plant.state_set.upper.0", data["reference"]["plant"]["state_set"]["upper"][0] + 1)
    assert sha(said(wider)) == sha(said(data))
    reordered = json.loads(json.dumps(data, sort_keys=True))
    assert sha(said(reordered)) == sha(said(data))
    for path in ("signals.0.mean", "signals.0.weights.0", "signals.0.centres.0", "signals.0.kernel.lengthscale"):
        *inner, last = (int(part) if part.isdigit() else part for part in path.split("."))
        value = data["reference"]
        for key in (*inner, last):
            value = value[key]
        moved = changed(data, f"reference.{path}", float(np.nextafter(value, np.inf)))
        assert sha(said(moved)) != sha(said(data))


def test_whole_numbers_and_floats_and_signs_of_zero_are_one() -> None:
    found = prove(reference(SquaredExponential(1.0, 0.3)))
    assert isinstance(found, Certificate)
    data = encode_certificate(found)
    for path, value in (("signals.0.kernel.signal_std", 1), ("signals.0.centres.0", -0.0), ("signals.0.centres.0", 0)):
        assert sha(said(changed(data, f"reference.{path}", value))) == fingerprint(found.reference)
