"""What counts as regular, and how far from it."""

import numpy as np
import pytest

from trackably.gp.factors.toeplitz import Grid

REGULAR = {
    "steps": 0.01 * np.arange(1000),
    "linspace": np.linspace(-3, 7, 777),
    "late": 1.7e9 + 0.5 * np.arange(100),
    "long ago": -1e5 + 0.1 * np.arange(500),
}


@pytest.mark.parametrize("times", REGULAR.values(), ids=REGULAR)
def test_steps_of_one_length_are_exact(times):
    grid = Grid.of(times)
    assert grid.is_exact
    assert grid.count == len(times)
    np.testing.assert_allclose(grid.start + grid.lags, times, atol=grid.rounding, rtol=0)
    assert grid.span == pytest.approx(times[-1] - times[0], rel=1e-15)


def test_the_deviation_is_the_largest():
    times = np.arange(11.0)
    times[3] += 3e-7
    times[8] -= 4e-7
    grid = Grid.of(times)
    assert grid.deviation == pytest.approx(4e-7, rel=1e-6)
    assert not grid.is_exact


def test_steps_that_were_added_up_are_regular_but_not_exact():
    grid = Grid.of(np.cumsum(np.full(20_000, 0.01)))
    assert 0 < grid.deviation < 1e-9
    assert not grid.is_exact


@pytest.mark.parametrize(
    "times",
    [[0.0], [0.0, 1.0], [0.0, 1.0, 3.0], [0.0, 1.0, 2.00001, 3.0], [1.0, 1.0, 1.0], [2.0, 1.0, 0.0], [[0.0, 1.0, 2.0]]],
)
def test_anything_else_is_no_grid(times):
    assert Grid.of(np.array(times)) is None
