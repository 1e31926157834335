"""The statement says of which reference: by a fingerprint, the span of its kernels, and its states at time zero."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.attack.bases import Base
from tests.attack.counts import Counts
from tests.attack.fingerprints import attack_fingerprint
from tests.project import ROOT
from tests.trackably.certificates.decoded import decode_certificate
from tests.trackably.certificates.test_prove import reference
from tests.trackably.checker.changes import changed
from tests.trackably.checker.edges.test_counterexamples import FOUND, counterexample
from tests.trackably.checker.files import file_of
from tests.trackably.checker.naive_fingerprint import fingerprint
from tests.trackably.checker.redundant import learned
from tests.trackably.checker.tight import VALID
from trackably import checker
from trackably.certificates.form import encode_certificate
from trackably.checker import Proved, Refuted, check
from trackably.checker.floats import boxes
from trackably.checker.formulas import Number, Operation, Power, text
from trackably.gp.kernels.squared_exponential import SquaredExponential

KINDS = (*VALID, "redundant inputs in the plane", "tank", "rest", "period", "end")


def said(data: dict) -> str:
    verdict = check(json.loads(json.dumps(data)))
    assert isinstance(verdict, Proved), verdict
    return verdict.statement


def sha(statement: str) -> str:
    return re.search(r"SHA-256 ([0-9a-f]{64})\b", statement)[1]


@pytest.mark.parametrize("kind", KINDS)
def test_prover_and_checker_find_the_same_fingerprint_and_start(kind: str) -> None:
    data = file_of(kind)
    statement, found = said(data), decode_certificate(data).reference
    assert sha(statement) == fingerprint(found)
    for name, value in zip(found.plant.system.states, found.state_at(np.zeros(())), strict=True):
        printed = re.search(rf'"{re.escape(name)}" = (\S+?)(,| at t = 0(\.0)? s)', statement)[1]
        assert float(printed) == pytest.approx(value, rel=1e-5, abs=1e-9)


def test_a_learned_reference_shows_the_same() -> None:
    found = learned()
    statement = said(encode_certificate(found.certificate))
    assert found.fingerprint == sha(statement)
    assert found.identity in repr(found)
    assert found.identity in statement


def test_all_zero_weights_are_seen() -> None:
    """Once the same sentence came for a reference that rests at its mean."""
    data = file_of("scalar")
    rests = said(changed(data, "reference.signals.0.weights", lambda weights: [0.0] * len(weights)))
    assert "no kernel at all" in rests
    assert f'"state" = {data["reference"]["signals"][0]["mean"]:.6g} at t = 0 s' in rests
    assert sha(rests) != sha(said(data))


CHANGES = {
    "a wider bound": ("plant.state_set.upper.0", lambda bound: bound + 1, True),
    "a whole number": ("signals.0.kernel.signal_std", int, True),
    "the other zero": ("signals.0.centres.0", lambda zero: -zero, True),
    **{
        number: (f"signals.0.{number}", lambda value: float(np.nextafter(value, np.inf)), False)
        for number in ("mean", "weights.0", "centres.0", "kernel.lengthscale")
    },
}


@pytest.mark.parametrize(("path", "change", "is_same"), CHANGES.values(), ids=CHANGES)
def test_every_number_of_the_reference_counts_and_nothing_else_does(path: str, change, is_same: bool) -> None:
    data = file_of("scalar")
    other = changed(data, f"reference.{path}", change)
    assert (sha(said(other)) == sha(said(data))) == is_same
    assert said(json.loads(json.dumps(other, sort_keys=True))) == said(other)


def test_where_the_fingerprint_stays_so_do_states_and_inputs() -> None:
    """Once all trajectories divided by ten had the same fingerprint, as weights are not unique."""
    counts: dict[str, Counts] = {}
    known = [Base("", file_of(kind), bool) for kind in (*KINDS, *(f"counterexample, {kind}" for kind in FOUND))]
    for number in range(30):
        attack_fingerprint(counts, known, 5, number)
    assert counts["fingerprints"].false == []
    assert counts["fingerprints"].accepted > 10


def test_a_certificate_and_a_counterexample_of_one_reference_have_one_fingerprint() -> None:
    assert sha(check(counterexample("all_times")).statement) == sha(said(file_of("scalar")))


def test_every_formula_of_a_flat_form_counts() -> None:
    data = json.loads((ROOT / "data/results/mobile-robot/certificates/joint.json").read_text())
    positive = changed(data, "reference.plant.system.flat.positive", [2.0])
    assert sha(said(positive)) != sha(said(data))


def test_an_answer_says_which_arithmetic_it_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = "This was checked in exact arithmetic:"
    assert "trusts IEEE arithmetic and NumPy's exp" in check(file_of("scalar")).statement
    assert exact in check(file_of("scalar"), exact=True).statement
    for data in (file_of("rest"), counterexample("all_times")):  # whole numbers alone, and a single time
        assert exact in check(data).statement
    monkeypatch.setattr(boxes, "FIRST_PASS", replace(boxes.FIRST_PASS, is_sound=lambda: False))  # no subnormal numbers
    assert exact in said(file_of("scalar"))


def test_times_are_printed_as_they_are() -> None:
    """Once with six digits, which may be later than what is proved."""
    data = changed(file_of("scalar"), "evaluation.until", 1234567.25)
    assert "at times up to 1234567.25 s" in said(data)


def test_a_negative_base_is_in_parentheses() -> None:
    assert text(Power(Number(-2.0), 2.0)) == "((-2.0) ^ 2.0)"
    assert text(Operation("+", Number(-2.0), Number(2.0))) == "((-2.0) + 2.0)"


@pytest.mark.parametrize(("upper", "wanted"), [(1e3, checker.Failed), (1e-3, Refuted)])
def test_what_a_counterexample_breaks_is_broken_by_as_much_as_it_says(upper: float, wanted: type) -> None:
    """Once a row that is kept was said to be broken, where another row of the same inputs is."""
    data = counterexample("all_times")
    value = float(reference(SquaredExponential(1.0, 0.3)).input_at(np.asarray(data["at"]["time"]))[0])
    assert value < -0.07
    rows = {"rows": [[1.0], [-1.0]], "lower": [-0.01, -1e3], "upper": [9.0, upper], "dimension": 1}
    data = changed(data, "reference.plant.input_set", rows)
    verdict = check({**data, "quantity": "-input", "violation": 0.05})
    assert isinstance(verdict, wanted), verdict
