"""The statement says of which reference: by a fingerprint, the span of its kernels, and its states at time zero."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.attack.bases import Base
from tests.attack.counts import Counts
from tests.attack.fingerprints import CHANGES, attack_fingerprint
from tests.trackably.certificates.nonlinear.instances import proved
from tests.trackably.certificates.test_prove import reference
from tests.trackably.checker.changes import part_at
from tests.trackably.checker.edges.test_counterexamples import by_claim
from tests.trackably.checker.instances import changed, scalar_certificate
from tests.trackably.checker.naive_fingerprint import fingerprint
from tests.trackably.checker.pieces import instances as pieces
from tests.trackably.checker.redundant import in_the_plane, learned
from tests.trackably.checker.tight import VALID
from tests.trackably.systems.forms.instances import certificate as of_flat_form
from trackably import checker
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
from trackably.checker import Proved, Refuted, check
from trackably.checker.boxes import NO_FIRST_PASS
from trackably.checker.floats import boxes
from trackably.checker.formulas import Number, Operation, Power, text
from trackably.gp.kernels.squared_exponential import SquaredExponential

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


def test_a_learned_reference_shows_the_same() -> None:
    found = learned()
    statement = said(encode_certificate(found.certificate))
    assert found.fingerprint == sha(statement)
    assert found.identity in repr(found)
    assert found.identity.replace("x1 =", '"x1" =').split(", ", 1)[1].startswith("25 kernels centred from 0 s to 8 s")
    assert f"SHA-256 {found.fingerprint}, 25 kernels" in found.identity


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
        value = part_at(data["reference"], tuple(int(key) if key.isdigit() else key for key in path.split(".")))
        moved = changed(data, f"reference.{path}", float(np.nextafter(value, np.inf)))
        assert sha(said(moved)) != sha(said(data))


def test_whole_numbers_and_floats_and_signs_of_zero_are_one() -> None:
    found = prove(reference(SquaredExponential(1.0, 0.3)))
    assert isinstance(found, Certificate)
    data = encode_certificate(found)
    for path, value in (("signals.0.kernel.signal_std", 1), ("signals.0.centres.0", -0.0), ("signals.0.centres.0", 0)):
        assert sha(said(changed(data, f"reference.{path}", value))) == fingerprint(found.reference)


@pytest.mark.parametrize("change", CHANGES)
def test_the_same_fingerprint_means_the_same_states_and_inputs(change: str) -> None:
    """Once all trajectories divided by ten had the same fingerprint, as weights are not unique."""
    files = [*(encode_certificate(make()) for make in (*VALID.values(), in_the_plane)), *by_claim().values()]
    counts: dict[str, Counts] = {}
    for number in range(20):
        attack_fingerprint(counts, [Base("", data, bool) for data in files], 0, number, change)
    assert counts["fingerprints"].false == []
    assert counts["fingerprints"].true > 0


def test_a_certificate_and_a_counterexample_of_one_reference_have_one_fingerprint() -> None:
    assert sha(check(by_claim()["all_times"]).statement) == sha(said(scalar_certificate()))


@pytest.mark.parametrize("beyond", ["rest", "period", "end"])
def test_prover_and_checker_find_the_same_fingerprint_of_pieces(beyond: str) -> None:
    assert sha(said(pieces.certificate(beyond))) == fingerprint(pieces.reference(beyond))


def test_every_formula_of_a_flat_form_counts() -> None:
    data = of_flat_form()
    positive = changed(data, "reference.plant.system.flat.positive", [2.0])
    assert sha(said(positive)) != sha(said(data))


def test_an_answer_says_which_arithmetic_it_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    floats, exact = (
        "trusts IEEE arithmetic and NumPy's exp, log, sqrt, cos, arctan and arctan2.",
        "This was checked in exact arithmetic:",
    )
    for data in (scalar_certificate(), pieces.certificate("rest")):
        assert floats in check(data).statement
        assert exact in check(data, exact=True).statement
    assert exact in check(by_claim()["all_times"]).statement  # a single time
    for other in (NO_FIRST_PASS, replace(boxes.FIRST_PASS, is_sound=lambda: False)):  # as without subnormal numbers
        monkeypatch.setattr(boxes, "FIRST_PASS", other)
        assert exact in said(scalar_certificate())


def test_a_negative_base_is_in_parentheses() -> None:
    assert text(Power(Number(-2.0), 2.0)) == "((-2.0) ^ 2.0)"
    assert text(Operation("+", Number(-2.0), Number(2.0))) == "((-2.0) + 2.0)"


@pytest.mark.parametrize(("upper", "wanted"), [(1e3, checker.Failed), (1e-3, Refuted)])
def test_what_a_counterexample_breaks_is_broken_by_as_much_as_it_says(upper: float, wanted: type) -> None:
    """Once a row that is kept was said to be broken, where another row of the same inputs is."""
    data = by_claim()["all_times"]
    value = float(reference(SquaredExponential(1.0, 0.3)).input_at(np.asarray(data["at"]["time"]))[0])
    assert value < -0.07
    rows = {"rows": [[1.0], [-1.0]], "lower": [-0.01, -1e3], "upper": [9.0, upper], "dimension": 1}
    data = changed(data, "reference.plant.input_set", rows)
    verdict = check({**data, "quantity": "-input", "violation": 0.05})
    assert isinstance(verdict, wanted), verdict
