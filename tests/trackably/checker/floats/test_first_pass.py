"""The first pass in float64 decides most, says nothing that mpmath does not say, and can be left out."""

import subprocess
import sys
from fractions import Fraction
from platform import machine

import pytest

from tests.project import ROOT
from tests.trackably.checker.instances import changed
from tests.trackably.checker.tight import VALID
from tests.trackably.exports.c_programs import CC
from trackably.certificates.form import encode_certificate
from trackably.checker import Failed, Proved, check
from trackably.checker.boxes import around_instant
from trackably.checker.floats import boxes
from trackably.checker.floats.intervals import are_positive

KINDS = {kind: lambda make=make: encode_certificate(make()) for kind, make in VALID.items()}


@pytest.mark.parametrize("kind", KINDS)
def test_an_exact_check_says_the_same(kind, monkeypatch):
    data = KINDS[kind]()
    known = check(data)
    monkeypatch.setattr(boxes, "FIRST_PASS", None)  # whoever asks for it fails
    exact = check(data, exact=True)
    assert type(exact) is type(known)
    (said, _), (before, _) = (str(verdict).split(" This was checked in ") for verdict in (exact, known))
    assert said == before


def test_what_fails_fails_for_the_same_reason():
    for kind, path, value in (
        ("window", "reference.plant.state_set.upper.0", 0.1),
        ("window", "reference.signals.0.weights.0", 0.6),
        ("window", "claim.terms", 2),
        ("window", "claim.covers.state.radii.0", 1e-3),
        ("instants", "reference.plant.state_set.upper.0", 0.1),
        ("instants", "reference.signals.0.weights.0", 0.6),
    ):
        data = changed(encode_certificate(VALID[kind]()), path, value)
        found = check(data)
        assert isinstance(found, Failed), path
        assert found == check(data, exact=True)


def test_a_first_pass_that_believes_every_box_makes_another_verdict(monkeypatch):
    """So the tests of tampering look at the first pass too."""
    of_window, of_instants = (
        changed(KINDS[kind](), "reference.plant.state_set.upper.0", 0.1) for kind in ("window", "instants")
    )
    assert check(of_instants).reason.startswith("instants: ")
    monkeypatch.setattr(boxes, "are_positive", lambda of: are_positive(of) | True)
    assert isinstance(check(of_window), Proved)
    assert check(of_instants).reason.startswith("tail: ")


@pytest.mark.parametrize("step", [0.1, 1 / 3, 1e-7])
def test_an_instant_is_in_its_box(step):
    for k in (0, 1, 3, 1000, 499_999):
        box = around_instant(k, step)
        assert Fraction(box.start) < k * Fraction(step) < Fraction(box.end)
        assert box.end - box.start < 1e-8 * step + 1e-14 * k * step


@pytest.mark.skipif(CC is None or machine() != "x86_64", reason="there is no C compiler, or another processor")
def test_a_processor_that_takes_subnormal_numbers_for_zero_is_found_out(tmp_path):
    source, library = tmp_path / "flush.c", tmp_path / "flush.so"
    source.write_text("#include <xmmintrin.h>\nvoid flush(void) { _mm_setcsr(_mm_getcsr() | 0x8040); }\n")
    subprocess.run([CC, "-shared", "-fPIC", "-o", library, source], check=True)
    script = (
        "import ctypes, sys; from trackably.checker.floats.boxes import FIRST_PASS; print(FIRST_PASS.is_sound()); "
        "ctypes.CDLL(sys.argv[1]).flush(); print(FIRST_PASS.is_sound())"
    )
    done = subprocess.run([sys.executable, "-c", script, library], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "False"]


def test_without_numpy_everything_is_left_to_mpmath():
    script = (
        "import json, sys; sys.modules['numpy'] = None; from trackably.checker import check; "
        "print(str(check(json.load(open(sys.argv[1])))).split(' This was checked in ')[1])"
    )
    file = ROOT / "data" / "results" / "example1" / "certificates" / "sound.json"
    done = subprocess.run([sys.executable, "-c", script, file], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("exact arithmetic")
