"""Whatever is changed in a certificate of polynomial pieces, it is refused, or what it says is still true."""

import json
from fractions import Fraction

import pytest

from tests.splines.naive import extremes
from tests.trackably.certificates.decoded import decode_certificate
from tests.trackably.checker.changes import changed, leaves, part_at, replacements, without
from tests.trackably.checker.pieces.instances import WINDOW, certificate, moved
from trackably.checker import Failed, NotACertificate, Proved, check

SIGNAL = ("reference", "signals", 0)
KINDS = ("rest", "period", "end")


@pytest.fixture(scope="module")
def certificates():
    found = {kind: certificate(kind) for kind in KINDS}
    for data in found.values():
        assert isinstance(check(data), Proved)
    return found


def refused(data) -> str:
    verdict = check(data)
    assert isinstance(verdict, Failed | NotACertificate)
    return verdict.reason


def test_where_a_signal_ends(certificates):
    for beyond in ("rest", "end"):
        assert "does not repeat" in refused(changed(certificates["period"], (*SIGNAL, "beyond"), beyond))
    for beyond in ("period", "end"):
        assert "not at rest" in refused(changed(certificates["rest"], (*SIGNAL, "beyond"), beyond))
    assert "must be one of" in refused(changed(certificates["rest"], (*SIGNAL, "beyond"), "for ever"))


def test_a_period_that_is_not_exact(certificates):
    data = certificates["period"]
    assert "does not repeat" in refused(changed(data, ("claim", "period"), 3.0000000000000004))
    assert isinstance(check(moved(data, 0.5)), Proved), "the same curve, half a second later"
    assert "does not repeat" in refused(moved(data, 0.1)), "3.1 − 0.1 is not 3 in float64"


def test_times_before_all_are_at_rest(certificates):
    data = certificates["rest"]
    assert "not at rest" in refused(changed(data, ("claim", "tail_start"), 2.9999))
    assert isinstance(check(changed(data, ("claim", "tail_start"), 3.5)), Proved)


def test_times_of_which_a_signal_says_nothing(certificates):
    data = certificates["end"]
    assert "ends before the last time" in refused(changed(data, ("claim", "end"), 2.91))
    assert "ends before the last time" in refused(changed(data, ("claim", "start"), -0.01))
    assert isinstance(check(changed(data, ("claim", "end"), WINDOW[1] - 0.5)), Proved)


def test_kinds_of_signals_are_not_mixed(certificates):
    kernels = {"kernel": {"type": "SquaredExponential", "signal_std": 1.0, "lengthscale": 1.0}, "mean": 0.0}
    data = certificates["rest"]
    signals = [*data["reference"]["signals"], {**kernels, "centres": [0.0], "weights": [1.0]}]
    refused(changed(data, ("reference", "signals"), signals))
    refused(changed(data, ("reference", "signals"), signals[::-1]))
    assert "kind" in refused(changed(data, ("claim",), {"kind": "instants", "last_step": 9}))
    assert "exactly the fields" in refused(changed(data, ("claim", "terms"), 3))


@pytest.mark.parametrize("kind", KINDS)
def test_no_change_makes_it_prove_what_is_false(certificates, kind):
    data, known = certificates[kind], {}
    changes = [without(data, path) for path in leaves(data)]
    changes += [changed(data, path, put) for path in leaves(data) for put in replacements(part_at(data, path))]
    accepted = [other for other in changes[::5] if isinstance(check(other), Proved)]
    assert len(changes) > 1000
    assert len(accepted) > 10
    for other in accepted:
        assert is_true(other, known), json.dumps(other)


def is_true(data, known) -> bool:
    found = decode_certificate(data)
    start, end = found.claim.span
    if end == float("inf"):
        start, end = 0.0, max(3.0, *(float(z.breakpoints[-1]) for z in found.reference.pieces))
    asked = json.dumps([start, end, data["reference"]["signals"], data["reference"]["plant"]["system"]])
    if asked not in known:
        of = (q.functional for q in found.reference.quantities)
        known[asked] = [extremes(each, found.reference.pieces, Fraction(start), Fraction(end)) for each in of]
    bounds = [q.bounds for q in found.reference.quantities]
    return all(b.lower <= low and high <= b.upper for b, (low, high) in zip(bounds, known[asked], strict=True))


@pytest.mark.parametrize("kind", KINDS)
def test_errors_of_evaluation_that_are_too_small(certificates, kind):
    for name, error in certificates[kind]["evaluation"]["errors"].items():
        assert 0 < error < 1e-14
        smaller = changed(certificates[kind], ("evaluation", "errors", name), error / 2)
        assert f"the {name} can be off by more" in refused(smaller)
    later = changed(certificates[kind], ("evaluation", "until"), 1e55)
    assert ("more periods than float64 can count" in refused(later)) if kind == "period" else check(later)
