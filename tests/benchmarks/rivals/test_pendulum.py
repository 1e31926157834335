import math

import numpy as np
import pytest

from benchmarks.rivals.page import PENDULUM
from benchmarks.rivals.pendulum import LEAST_SPEED, MOST_W, Row, proved, transcribed
from benchmarks.rivals.tables import read


def test_tightened_bounds_reach_the_printed_number():
    found, row = transcribed(200, cones=True), read(Row, PENDULUM)[1]
    assert math.floor(100 * found.final_speed) == 149 == round(100 * row.printed)
    assert found.final_speed == pytest.approx(row.final_speed, abs=1e-6)
    assert found.violation == (0, 0)


def test_a_grid_alone_breaks_the_bound_between_its_points_by_about_what_is_printed():
    # Printed: 3.21, and 11.48 on a grid of 800 points, by a solver that was given a singular matrix plus 1e-8.
    found = transcribed(200, cones=False)
    assert found.final_speed == pytest.approx(3.21, abs=0.03)
    assert found.largest_w == pytest.approx(11.48, abs=0.15)
    least, most = found.violation
    assert 1.5 < least <= most == pytest.approx(found.largest_w - MOST_W, abs=1e-6)
    times = found.w.breakpoints[found.w.breakpoints != 1 / 3]  # where x is given, and nothing is asked of w
    assert np.max(np.abs(found.w(times))) < 10 + 1e-6
    assert [found.x(0.0), found.speed(0.0), found.w(0.0), found.x(1 / 3), found.x(1.0)] == pytest.approx(
        [0.5, 0, 0, 0.5, 0], abs=1e-6
    )


def test_a_spline_is_proved_for_all_times_with_the_speed_that_the_issue_asks_for():
    spline = proved(60)
    assert spline.violation == (0, 0)
    assert spline.final_speed > 2.97
    assert [spline.x(0.0), spline.speed(0.0), spline.x(1 / 3), spline.x(1.0)] == pytest.approx(
        [0.5, 0, 0.5, 0], abs=1e-12
    )
    t, h = np.linspace(0, 1, 20_001), 1e-4
    assert np.max(np.abs(spline.w(t))) <= MOST_W
    assert np.min(spline.speed(t)) >= LEAST_SPEED
    t = t[9:-9]
    second = (spline.x(t + h) - 2 * spline.x(t) + spline.x(t - h)) / h**2
    assert spline.w(t) == pytest.approx(second + 10 * spline.x(t), abs=1e-3)
