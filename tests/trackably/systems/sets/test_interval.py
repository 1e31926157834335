"""Closed intervals."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackably.certificates.claim import times_of
from trackably.checker.certificate import Window
from trackably.systems.intervals import Interval, rounded_text


@pytest.mark.parametrize(
    ("lower", "upper"), [(1.0, 0.0), (math.nan, 0.0), (0.0, math.nan), (-math.inf, 0.0), (0.0, math.inf)]
)
def test_impossible_bounds_are_refused(lower, upper):
    with pytest.raises(ValueError, match=rf"finite bounds, lower .* upper, got \[{lower}, {upper}\]$"):
        Interval(lower, upper)


def test_margin_is_the_distance_to_the_nearer_bound_and_negative_outside():
    values = np.array([-3.0, -2.0, -1.5, 0.0, 1.0, 2.0, 2.25])
    np.testing.assert_array_equal(Interval(-2.0, 2.0).margin(values), [-1.0, 0.0, 0.5, 2.0, 1.0, 0.0, -0.25])


def test_margin_of_another_interval_is_its_smallest():
    whole = Interval(-2.0, 3.0)
    for part in (Interval(-1.0, 2.5), Interval(-2.0, 0.0), Interval(0.0, 3.5), Interval(-4.0, 4.0)):
        margins = whole.margin(np.linspace(part.lower, part.upper, 101))
        assert whole.margin_of(part) == np.min(margins)
        assert whole.contains(part) == bool(np.all(margins >= 0))


@given(st.floats(-1e9, 1e9), st.floats(1e-9, 1e9))
def test_what_is_printed_is_within_a_hundredth_of_the_width(lower: float, width: float) -> None:
    interval = Interval(lower, max(lower + width, float(np.nextafter(lower, np.inf))))
    first, last = (float(end) for end in str(interval)[1:-1].split(", "))
    assert abs(first - interval.lower) + abs(last - interval.upper) <= 0.01 * interval.width


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
