"""Closed intervals."""

import math

import numpy as np
import pytest

from trackable.systems.sets.interval import Interval


@pytest.mark.parametrize(
    ("lower", "upper"), [(1.0, 0.0), (math.nan, 0.0), (0.0, math.nan), (-math.inf, 0.0), (0.0, math.inf)]
)
def test_impossible_bounds_are_refused(lower, upper):
    with pytest.raises(ValueError, match=rf"finite bounds, lower .* upper, got \[{lower}, {upper}\]$"):
        Interval(lower, upper)


def test_width_and_text():
    assert Interval(-2.0, 0.05).width == 2.05
    assert str(Interval(-2.0, 0.05)) == "[-2, 0.05]"


def test_margin_is_the_distance_to_the_nearer_bound_and_negative_outside():
    values = np.array([-3.0, -2.0, -1.5, 0.0, 1.0, 2.0, 2.25])
    np.testing.assert_array_equal(Interval(-2.0, 2.0).margin(values), [-1.0, 0.0, 0.5, 2.0, 1.0, 0.0, -0.25])


def test_margin_of_another_interval_is_its_smallest():
    whole = Interval(-2.0, 3.0)
    for part in (Interval(-1.0, 2.5), Interval(-2.0, 0.0), Interval(0.0, 3.5), Interval(-4.0, 4.0)):
        margins = whole.margin(np.linspace(part.lower, part.upper, 101))
        assert whole.margin_of(part) == np.min(margins)
        assert whole.contains(part) == bool(np.all(margins >= 0))


def test_contains_its_bounds_but_does_not_hold_them_inside():
    whole = Interval(0.0, 1.0)
    assert whole.contains(whole)
    assert not whole.contains(Interval(-1e-12, 0.5))
    assert not whole.contains(Interval(0.5, 1.0 + 1e-12))
    assert [whole.strictly_contains(v) for v in (-0.1, 0.0, 0.5, 1.0, 1.1)] == [False, False, True, False, False]


def test_shrunk_by_as_much_on_each_side():
    assert Interval(-1.0, 2.0).shrunk(0.25) == Interval(-0.75, 1.75)
    with pytest.raises(ValueError, match="lower"):
        Interval(-1.0, 2.0).shrunk(1.6)
