"""Where on the steps a margin is smallest, against a loop that looks at every plateau."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.learning.index_set import Steps


def minima_of(values: list[float], first: int = 0) -> list[int]:
    """Indices that `Steps` names for these margins."""
    steps = Steps(first, first + len(values) - 1, 0.5)
    times = steps.local_minima(lambda t: np.array(values, dtype=float)[np.rint(t / 0.5).astype(int) - first])
    return [round(t / 0.5) - first for t in times.tolist()]


def plateaus(values: list[float]) -> list[tuple[int, int]]:
    """First and last index of each run of equal values that is lower than both of its neighbours."""
    found, start = [], 0
    for i in range(1, len(values) + 1):
        if i == len(values) or values[i] != values[start]:
            falls_in = start == 0 or values[start - 1] > values[start]
            rises_out = i == len(values) or values[i] > values[start]
            if falls_in and rises_out:
                found.append((start, i - 1))
            start = i
    return found


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([3.0], [0]),
        ([1.0, 2.0, 3.0], [0]),
        ([3.0, 2.0, 1.0], [2]),
        ([3.0, 1.0, 2.0, 0.0, 5.0], [1, 3]),
        ([1.0, 2.0, 1.0], [0, 2]),
        ([2.0, 1.0, 1.0, 1.0, 2.0], [1]),
        ([1.0, 1.0, 1.0], [0]),
        ([2.0, 2.0, 3.0, 1.0, 1.0], [0, 3]),
        ([], []),
    ],
)
def test_minima_in_numbers(values, expected):
    assert minima_of(values) == expected


@given(st.lists(st.floats(-10, 10), unique=True, max_size=30), st.integers(0, 5))
def test_minima_of_distinct_values_are_those_of_a_loop(values, first):
    assert minima_of(values, first) == [i for i, _ in plateaus(values)]


@given(st.lists(st.integers(0, 3).map(float), min_size=1, max_size=30))
def test_every_lowest_plateau_is_named_once_by_its_first_step(values):
    named = minima_of(values)
    for begin, end in plateaus(values):
        assert [i for i in named if begin <= i <= end] == [begin]
    for i in named:
        assert values[i] <= min(values[max(i - 1, 0) : i + 2])
    assert min(values[i] for i in named) == min(values)


def test_times_are_the_instants_of_the_steps():
    asked: list[np.ndarray] = []
    Steps(3, 7, 0.01).local_minima(lambda t: (asked.append(t), np.abs(t - 0.05))[1])
    np.testing.assert_array_equal(asked[0], np.arange(3, 8) * 0.01)
