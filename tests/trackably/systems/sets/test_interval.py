"""Closed intervals."""

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from trackably.certificates.claim import as_claim, times_of
from trackably.checker.certificate import Window
from trackably.gp.samples import Samples
from trackably.systems.intervals import Interval, rounded_text


def test_margin_of_another_interval_is_its_smallest():
    whole = Interval(-2.0, 3.0)
    for part in (Interval(-1.0, 2.5), Interval(-2.0, 0.0), Interval(0.0, 3.5), Interval(-4.0, 4.0)):
        margins = whole.margin(np.linspace(part.lower, part.upper, 101))
        assert whole.margin_of(part) == np.min(margins)


FINITE = st.floats(-1e300, 1e300)


def _numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d[\d.]*(?:e[+-]\d+)?", text)]


@given(FINITE, st.integers(1, 17))
def test_a_number_is_rounded_in_the_direction_that_is_asked_for(value: float, digits: int) -> None:
    down, up = (float(rounded_text(value, towards, digits)) for towards in ("down", "up"))
    assert down <= value <= up
    assert float(f"{value:.{digits}g}") in (down, up)


@given(st.tuples(FINITE, FINITE).map(sorted))
def test_printed_bounds_contain_the_bounds_and_a_printed_window_is_inside_of_the_window(ends: list[float]) -> None:
    """What is proved of these bounds in this window is then true of what is printed."""
    low, high = _numbers(str(Interval(*ends)))
    assert low <= ends[0] <= ends[1] <= high
    assert _numbers(Interval(*ends).exactly) == ends
    if ends[0] < ends[1]:
        first, last = _numbers(times_of(Window(*ends)))
        assert ends[0] <= first <= last <= ends[1]


def test_the_ends_of_a_window_are_named_without_rounding_errors_or_as_the_certificate_does() -> None:
    assert times_of(Window(7 * 0.05, 2.9999998)).endswith("from 0.35000000000000003 s to 2.99999 s")
    samples = {"x": Samples([0.38, 0.52], [0, 0])}
    assert times_of(as_claim("recorded", samples, 0.05)).endswith("from 0.35 s to 0.55 s")
