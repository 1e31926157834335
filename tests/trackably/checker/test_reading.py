"""What is no certificate, and what is read exactly."""

from fractions import Fraction

import pytest

from tests.trackably.checker.changes import changed, leaves, part_at, without
from tests.trackably.checker.files import file_of
from trackably.checker import Failed, NotACertificate, check
from trackably.checker.form import rational_number
from trackably.checker.limits import DIGITS

FORMS = (
    *("scalar", "tank", "pushed cart", "rest", "counterexample, all_times", "counterexample, instants"),
    *("contradiction", "contradiction by boxes", "joints", "broken joints"),
)


HOSTILE = ("\ud800\x1b[2J\u202ex", "a\nProved: x ≤ 1, y", "x" * 2000)


@pytest.mark.parametrize("kind", FORMS)
def test_a_part_of_another_kind_a_field_more_or_a_field_less_make_it_unreadable_in_a_printable_line(kind):
    """Each field, and the first entry of each list."""
    data = file_of(kind)
    for path in leaves(data):
        value = part_at(data, path)
        if any(key for key in path if isinstance(key, int)) or value is None:
            continue
        others = [True, float("nan"), float("inf"), *([] if isinstance(value, str) else ["no number"])]
        others += [{**value, "more": None}] if isinstance(value, dict) else [{}]
        for other in others if path != ("version",) else [2.5, True, "3", None]:
            assert isinstance(check(changed(data, path, other)), NotACertificate), (path, other)
        for text in HOSTILE:
            for put in (text, {**value, text: 1}) if isinstance(value, dict) else (text,):
                verdict = check(changed(data, path, put))
                assert isinstance(verdict, NotACertificate | Failed), path
                assert verdict.reason.isprintable()
                assert len(verdict.reason) < 300
        if isinstance(path[-1], str) and path != ("disturbance",):
            assert isinstance(check(without(data, path)), NotACertificate | Failed), path
    assert isinstance(check({**data, "more": 1.0}), NotACertificate)


@pytest.mark.parametrize(
    "nothing",
    [None, 1, "text", [], {}, {"format": "trackably certificate"}, float("nan"), [{}], {1: 2}],
)
def test_other_things_are_no_certificates(nothing):
    assert isinstance(check(nothing), NotACertificate)


def test_a_kernel_nested_without_end_is_refused():
    data = file_of("scalar")
    kernel = data["reference"]["signals"][0]["kernel"]
    for _ in range(500):
        kernel = {"type": "sum", "left": kernel, "right": kernel}
    assert isinstance(check(changed(data, "reference.signals.0.kernel", kernel)), NotACertificate)


@pytest.mark.parametrize("path", ["version", "claim.tail_start", "reference.signals.0.mean", "trajectories.states"])
def test_an_integer_that_python_does_not_write_is_refused_in_words(path):
    found = check(changed(file_of("scalar"), path, 10**5000))
    assert isinstance(found, NotACertificate)
    assert "an integer of 16610 bits" in found.reason


def test_rationals_are_read_exactly():
    """However many digits they have, and whether or not they are reduced."""
    long = 3**8000
    for text, value in (
        ("-12/8", Fraction(-3, 2)),
        ("007", Fraction(7)),
        ("-0", Fraction(0)),
        ("9" * DIGITS, Fraction(10**DIGITS - 1)),
        (f"-{long}/7", Fraction(-long, 7)),
        (f"-1/{'1' + '0' * 3000}", Fraction(-1, 10**3000)),
    ):
        assert rational_number(text, "here") == value
