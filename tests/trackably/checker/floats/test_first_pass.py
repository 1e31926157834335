"""The first pass in float64 decides most, says nothing that mpmath does not say, and can be left out."""

import subprocess
import sys
from collections import Counter
from copy import deepcopy
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from platform import machine

import numpy as np
import pytest

from tests.project import ROOT
from tests.trackably.certificates.nonlinear.instances import proved
from tests.trackably.checker.changes import changed
from tests.trackably.checker.tight import VALID, data_of
from tests.trackably.exports.c_programs import CC
from trackably.certificates.form import encode_certificate
from trackably.checker import Proved, check
from trackably.checker import boxes as exact_boxes
from trackably.checker.boxes import Box, around_instant, stays_inside
from trackably.checker.floats import boxes
from trackably.checker.floats.boxes import nowhere_negative, stay_inside
from trackably.checker.floats.intervals import Floats
from trackably.checker.intervals import ZERO
from trackably.checker.moving import Limit
from trackably.checker.quantities import LinearCombination, Quantity
from trackably.checker.subject import Pieces


@pytest.mark.parametrize("kind", [*VALID, "tank", "pendulum"])
def test_it_decides_most_boxes(kind, monkeypatch):
    """Of pairs of a box and a quantity, few are left to mpmath."""
    every = left = 0

    def counted(needs, subject, terms, held):
        nonlocal every, left
        for box, rest in boxes.boxes_left(needs, subject, terms, held):
            every, left = every + len(held[box]), left + len(rest)
            yield box, rest

    monkeypatch.setattr(boxes, "FIRST_PASS", replace(boxes.FIRST_PASS, boxes=counted))
    assert isinstance(check(data_of(kind) if kind in VALID else encode_certificate(proved(kind))), Proved)
    assert left <= every / 20 > 0


def test_a_broken_bound_is_found_before_later_boxes_are_decided(monkeypatch):
    """A file whose bounds are broken everywhere takes no longer than up to its first box."""
    asked = []
    monkeypatch.setattr(exact_boxes, "stays_inside", lambda *of: asked.append(of) or stays_inside(*of))
    assert check(changed(data_of("instants"), "reference.plant.state_set.upper.0", -0.6)).reason.endswith("at step 0")
    assert len(asked) <= 2  # a state and an input


def test_a_first_pass_that_believes_every_box_makes_another_verdict(monkeypatch):
    """So the tests of tampering look at the first pass too."""
    broken = changed(data_of("window"), "reference.plant.state_set.upper.0", 0.1)
    assert check(broken).reason.startswith("box: ")
    monkeypatch.setattr(boxes, "nowhere_negative", lambda *of: nowhere_negative(*of) | True)
    assert isinstance(check(broken), Proved)


@pytest.mark.parametrize("side", ["lower", "upper"])
def test_an_end_that_moves_is_compared_with_all_of_its_powers_and_pieces(side):
    """Also with those powers that Taylor models do not have: here they have three, and the end has up to six."""
    rng, verdicts = np.random.default_rng(0), Counter[tuple[bool, bool]]()
    sign = 1 if side == "upper" else -1
    for _ in range(200):
        coefficients = tuple(tuple(rng.normal(size=7) * 0.4 ** np.arange(7)) for _ in range(2))
        moving, far = Pieces((0.0, 1.0, 2.0), coefficients, "rest"), Limit(-sign * 100.0, ZERO)
        ends = {"lower": far, "upper": far, side: Limit(moving, ZERO)}
        q = Quantity("q", [], {}, ends["lower"], ends["upper"])
        seen = zip(coefficients, (np.linspace(0.5, 1, 999), np.linspace(0, 0.5, 999)), strict=True)
        room = np.min([sign * np.polyval(c[::-1], x) for c, x in seen])
        constant = sign * (room + rng.choice([1e-3, -1e-3, 0.2, -0.2]))
        found = Floats.exact(np.array([[constant], [0.0], [0.0]]))
        shown = bool(stay_inside(found, q, [Box(0.5, 1.5, 1.0)])[0])
        verdicts[shown, bool(sign * constant <= room)] += 1
    assert not verdicts[True, False]
    assert verdicts[True, True] > 20


@pytest.mark.parametrize("kind", ["window", "tank"])
def test_a_remainder_that_is_too_large_shows_nothing(kind):
    """On discs that are hardly wider than their boxes, Cauchy's estimate bounds a remainder by far more than a set."""
    data = deepcopy(data_of(kind) if kind in VALID else encode_certificate(proved(kind)))
    for cover in data["claim"]["covers"].values():
        cover["radii"] = [0.5001 * (end - start) for start, end in pairwise(cover["ends"])]
    assert check(data).reason.startswith("box: ")


def test_remainders_of_a_difference_add_up():
    """What the models of z(t) and of z(t + T) miss may have either sign, and so may their weights."""
    missed = Floats.exact(np.array([[0.0], [1.0]]))
    change = LinearCombination([[Fraction(-1), Fraction(1)]], ZERO, [Fraction(2)], Fraction(0))
    found = boxes._combination(change, {(0, 0): missed, (0, 1): missed}, np.arange(1), 1)
    assert found.missed.high >= 2


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


FILES = ROOT / "data" / "results" / "example1" / "certificates"


@pytest.mark.parametrize(
    ("name", "before", "said", "is_loaded"),
    [
        ("sound.json", "sys.modules['numpy'] = None", "exact arithmetic", True),
        ("unconstrained.counterexample.json", "pass", "exact arithmetic", False),
        ("joint.json", "pass", "float64 intervals", True),
    ],
)
def test_numpy_is_loaded_only_where_it_is_asked_and_may_be_missing(name, before, said, is_loaded):
    """Loading it takes longer than most checks; without it everything is left to mpmath."""
    script = (
        f"import json, sys; {before}; from trackably.checker import check; "
        "print(check(json.load(open(sys.argv[1]))).statement, 'numpy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script, FILES / name], capture_output=True, text=True, check=True)
    assert f"This was checked in {said}" in done.stdout
    assert done.stdout.split()[-1] == str(is_loaded)
