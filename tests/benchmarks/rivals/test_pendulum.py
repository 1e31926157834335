import math
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
import scipy

from benchmarks.rivals.judge.polynomials import Pieces
from benchmarks.rivals.pendulum import proved, transcribed
from benchmarks.rivals.pendulum.statement import A, B, facts


@cache
def on_grid():
    return transcribed.solve(200, cones=False)


def integrated(trajectory, t):
    """States at t [s] by a numerical integrator, from the stored states and costates of the interval."""
    i = min(int(np.searchsorted(trajectory.times, t, side="right")) - 1, len(trajectory.costates) - 1)
    start = np.concatenate([trajectory.states[i], trajectory.costates[i]])
    M = np.block([[A, B @ B.T], [np.zeros((3, 3)), -A.T]])
    return (scipy.linalg.expm(M * (t - trajectory.times[i])) @ start)[:3]


def test_tightened_bounds_reach_the_printed_number():
    found = transcribed.solve(200, cones=True)
    assert math.floor(100 * found.facts().final_speed) == 149
    assert found.facts().kept


def test_a_grid_alone_breaks_the_bound_between_its_points_by_about_what_is_printed():
    # Printed: 3.21, and 11.48 on a grid of 800 points, by a solver that was given a singular matrix plus 1e-8.
    found = on_grid().facts()
    assert found.final_speed == pytest.approx(3.21, abs=0.03)
    assert found.w[0] == pytest.approx(11.48, abs=0.15)
    assert found.violation[0] > 1.5
    at = on_grid().times != 1 / 3  # where x is given, and nothing is asked of w
    assert np.max(np.abs(on_grid().states[at, 2])) < 10 + 1e-6


def test_between_grid_points_the_trajectory_is_the_one_that_is_integrated():
    trajectory = on_grid()
    assert integrated(trajectory, trajectory.times[7])[:3] == pytest.approx(trajectory.states[7])
    ends = [integrated(trajectory, t - 1e-12) for t in trajectory.times[1:]]
    assert np.array(ends) == pytest.approx(trajectory.states[1:], abs=1e-6)
    seen = max(abs(integrated(trajectory, t)[2]) for t in np.linspace(0, 1, 3001))
    assert trajectory.facts().w[0] == pytest.approx(seen, abs=0.05)
    assert trajectory.facts().w[1] >= seen


def test_a_spline_is_proved_for_all_times_with_the_speed_that_the_issue_asks_for():
    spline = proved.solve(60)
    assert spline.residuals() == (0,) * 5
    assert spline.facts().kept
    assert spline.final_speed > Fraction(297, 100)
    t = np.linspace(0, 1, 20_001)
    assert np.max(np.abs(spline.w(t))) <= 10
    assert np.min(spline.x.derivative()(t)) >= -3


def test_a_spike_between_the_grid_points_is_no_proof():
    flat = Pieces((Fraction(0), Fraction(1)), ((Fraction(0),),))
    spike = Pieces((Fraction(0), Fraction(1)), ((Fraction(0), Fraction(4004, 100), Fraction(-4004, 100)),))
    assert facts(flat, flat, 0.0).kept
    assert not facts(flat, spike, 0.0).kept
    assert not facts(flat, flat, 0.0, missed=Fraction(11)).kept
