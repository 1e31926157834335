"""The statement says of which reference: by a fingerprint, the span of its kernels, and its states at time zero."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import partial

import numpy as np
import pytest

from tests.project import ROOT
from tests.trackably.certificates.nonlinear.instances import proved
from tests.trackably.certificates.test_prove import reference
from tests.trackably.checker.changes import part_at
from tests.trackably.checker.edges.test_counterexamples import by_claim
from tests.trackably.checker.instances import changed, scalar_certificate
from tests.trackably.checker.naive_fingerprint import fingerprint
from tests.trackably.checker.pieces import instances as pieces
from tests.trackably.checker.redundant import in_the_plane, learned
from tests.trackably.checker.tight import VALID, certificate
from trackably import checker
from trackably.certificates.form import encode_certificate
from trackably.checker import Proved, Refuted, check
from trackably.checker.boxes import NO_FIRST_PASS
from trackably.checker.floats import boxes
from trackably.checker.formulas import Number, Operation, Power, text
from trackably.checker.intervals import between, exactly
from trackably.gp.kernels.squared_exponential import SquaredExponential

CERTIFICATES = {
    **{kind: partial(certificate, kind) for kind in VALID},
    "redundant inputs": in_the_plane,
    "nonlinear": lambda: proved("tank"),
}
KINDS = {
    **{kind: lambda make=make: (encode_certificate(make()), make().reference) for kind, make in CERTIFICATES.items()},
    **{of: lambda of=of: (pieces.certificate(of), pieces.reference(of)) for of in ("rest", "period", "end")},
}


def said(data: dict) -> str:
    verdict = check(json.loads(json.dumps(data)))
    assert isinstance(verdict, Proved), verdict
    return verdict.statement


def sha(statement: str) -> str:
    return re.search(r"SHA-256 ([0-9a-f]{64})\b", statement)[1]


def with_weights(data: dict, change: Callable[[Fraction], Fraction]) -> dict:
    """The file with all weights of its trajectories changed, and bounds that are kept by far."""
    data = json.loads(json.dumps(data))
    for part in (*data["trajectories"]["states"], *data["trajectories"]["inputs"]):
        part["weights"] = [[str(change(Fraction(w))) for w in of_signal] for of_signal in part["weights"]]
    for side in () if "attainable" in data else ("state_set", "input_set"):
        bounded = data["reference"]["plant"][side]
        bounded["lower"], bounded["upper"] = ([end] * len(bounded["rows"]) for end in (-1e3, 1e3))
    if "evaluation" in data:
        data["evaluation"]["errors"] = dict.fromkeys(data["evaluation"]["errors"], 1e-6)
    return data


def rewritten(data: dict) -> dict:
    """The same numbers, written in other ways."""
    data = json.loads(json.dumps(data))
    for side, shifts in (("states", 3), ("inputs", 1)):
        for part in data["trajectories"][side]:
            offset = Fraction(part["offset"])
            part["offset"] = f"{7 * offset.numerator}/{7 * offset.denominator}" if offset else "-0"
            part["weights"] = [
                [f"{w}/01" if "/" not in w else w for w in ws] + ["0/9"] * shifts for ws in part["weights"]
            ]
    return data


@pytest.mark.parametrize("kind", KINDS)
def test_prover_and_checker_find_the_same_fingerprint_and_start(kind: str) -> None:
    data, found = KINDS[kind]()
    statement = said(data)
    assert sha(statement) == fingerprint(found)
    for name, value in zip(found.plant.system.states, found.state_at(np.zeros(())), strict=True):
        printed = re.search(rf'"{re.escape(name)}" = (\S+?)(,| at t = 0(\.0)? s)', statement)[1]
        assert float(printed) == pytest.approx(value, rel=1e-5, abs=1e-9)


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
        quick = replace(boxes.FIRST_PASS, at_zero=lambda *_, near=near: near)
        monkeypatch.setattr(boxes, "FIRST_PASS", quick)
        assert said(data) == known
    monkeypatch.setattr(boxes, "FIRST_PASS", replace(boxes.FIRST_PASS, at_zero=lambda *_: exactly(0.5)))
    assert '"state" = 0.5 at t = 0 s' in said(data) != known


def test_all_zero_weights_are_seen() -> None:
    """Once the same sentence came for a reference that rests at its mean."""
    data = scalar_certificate()
    rests = changed(data, "reference.signals.0.weights", [0.0] * len(data["reference"]["signals"][0]["weights"]))
    assert "no kernel at all" in said(rests)
    assert f'"state" = {data["reference"]["signals"][0]["mean"]:.6g} at t = 0 s' in said(rests)
    assert sha(said(rests)) != sha(said(data))


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
    data = scalar_certificate()
    value = part_at(data["reference"], tuple(int(key) if key.isdigit() else key for key in path.split(".")))
    other = changed(data, f"reference.{path}", change(value))
    assert (sha(said(other)) == sha(said(data))) == is_same
    assert said(json.loads(json.dumps(other, sort_keys=True))) == said(other)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "nonlinear"])
def test_the_same_fingerprint_means_the_same_states_and_inputs(kind: str) -> None:
    """Once all trajectories divided by ten had the same fingerprint, as weights are not unique."""
    data, _ = KINDS[kind]()
    errors = data["evaluation"]["errors"]
    errors |= {name: 1.5 * error for name, error in errors.items()}  # for roundings of the zeros that are added
    known = sha(said(data))
    assert sha(said(rewritten(data))) == known
    divided = with_weights(data, lambda w: w / 10)
    assert sha(said(divided)) != known
    assert sha(said(with_weights(divided, lambda w: w * 10))) == known


@pytest.mark.parametrize("kind", [kind for kind in by_claim() if kind != "nonlinear"])
def test_a_counterexample_of_other_states_has_another_fingerprint(kind: str) -> None:
    data = by_claim()[kind]
    doubled = with_weights(data, lambda w: 2 * w)
    doubled["reference"] = data["reference"]  # with its bounds
    verdicts = [check(one) for one in (data, rewritten(data), doubled)]
    assert all(isinstance(verdict, Refuted) for verdict in verdicts)
    known, same, other = (sha(verdict.statement) for verdict in verdicts)
    assert known == same != other


def test_a_certificate_and_a_counterexample_of_one_reference_have_one_fingerprint() -> None:
    assert sha(check(by_claim()["all_times"]).statement) == sha(said(scalar_certificate()))


def test_every_formula_of_a_flat_form_counts() -> None:
    data = json.loads((ROOT / "data/results/mobile-robot/certificates/joint.json").read_text())
    positive = changed(data, "reference.plant.system.flat.positive", [2.0])
    assert sha(said(positive)) != sha(said(data))


def test_an_answer_says_which_arithmetic_it_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    floats, exact = (
        "trusts IEEE arithmetic and NumPy's exp, log, sqrt, cos, arctan and arctan2.",
        "This was checked in exact arithmetic:",
    )
    assert floats in said(scalar_certificate())
    assert exact in check(scalar_certificate(), exact=True).statement
    for data in (pieces.certificate("rest"), by_claim()["all_times"]):  # whole numbers alone, and a single time
        assert exact in check(data).statement
    for other in (NO_FIRST_PASS, replace(boxes.FIRST_PASS, is_sound=lambda: False)):  # as without subnormal numbers
        monkeypatch.setattr(boxes, "FIRST_PASS", other)
        assert exact in said(scalar_certificate())


def test_times_are_printed_as_they_are() -> None:
    """Once with six digits, which may be later than what is proved."""
    data = changed(scalar_certificate(), "evaluation.until", 1234567.25)
    assert "at times up to 1234567.25 s" in said(data)


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
