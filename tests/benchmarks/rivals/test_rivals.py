from functools import cache

import numpy as np
import pytest

from benchmarks.rivals import page, table
from benchmarks.rivals.adapters import fine_grid, ours, tightened
from benchmarks.rivals.adapters.rows import Grid, evenly
from benchmarks.rivals.curves import curve_of
from benchmarks.rivals.model import Found, NotFound, Promise, Rival
from benchmarks.rivals.page import RIVALS
from benchmarks.rivals.problems import problem, problems
from benchmarks.rivals.table import objective_of
from benchmarks.rivals.tables import read
from trackably.gp.row_posterior import RowPosterior
from trackably.learning.joint.dual import solve_dual


@cache
def found(rival):
    answer = rival(problem("example1"))
    assert isinstance(answer, Found), answer
    return answer


def on_a_dense_grid(curve, window):
    """The largest violation at ten thousand times, in float64."""
    t = np.linspace(*window, 10_001)
    reference = curve.reference
    return max(float(np.max(-q.margin(reference.signals, t))) / q.bounds.width for q in reference.quantities)


def test_the_violation_of_an_unconstrained_mean_is_what_dense_times_show():
    of = problem("example1")
    curve = curve_of(of.likeliest.posterior.signals, of)
    violation = curve.violation(of.window)
    dense = on_a_dense_grid(curve, of.window)
    assert dense == pytest.approx(0.0203, abs=1e-4)
    assert violation.least == pytest.approx(dense, rel=1e-6)
    assert violation.least <= violation.most <= 1.001 * violation.least
    assert violation.quantity == "state"


def test_a_fine_grid_leaves_a_violation_between_its_times_and_the_joint_reference_none():
    on_grid = found(fine_grid.solve)
    window = problem("example1").window
    assert 0 < on_grid.curve.violation(window).least < 1e-3
    assert on_a_dense_grid(on_grid.curve, window) > 0
    assert found(ours.JOINT.solve).curve.violation(window).is_none


def test_the_fine_grid_has_the_minimum_that_the_dual_program_has():
    of = problem("example1")
    answer, posterior, grid = found(fine_grid.solve), of.likeliest.posterior, Grid.of(of, evenly(of, 200))
    given = RowPosterior(posterior, grid.rows)
    rows = np.vstack([np.eye(len(grid.rows)), -np.eye(len(grid.rows))])
    demand = np.concatenate([grid.lower - given.mean, given.mean - grid.upper])
    dual = solve_dual(rows @ given.covariance @ rows.T, demand, np.zeros(len(demand), dtype=bool))
    least = posterior.negative_log_marginal_likelihood()[0]
    assert answer.objective - least == pytest.approx(dual.value, rel=1e-4)
    assert objective_of(of, answer) == pytest.approx(answer.objective, abs=1e-5)


def test_cones_keep_the_bounds_between_their_times_and_cost_more_than_a_fine_grid():
    answer = found(tightened.solve)
    of = problem("example1")
    assert answer.curve.violation(of.window).is_none
    assert objective_of(of, answer) > objective_of(of, found(fine_grid.solve))


def test_a_rival_that_fails_is_a_row_that_says_so():
    rival = Rival("z", "nobody", Promise("", "nowhere"), lambda _: NotFound("infeasible", "there is no such curve"))
    row = table.measured(problem("example1"), rival)
    assert (row.answer, row.least) == ("infeasible", None)
    assert "there is no such curve" in table.page([row])


def test_committed_rows_are_of_known_problems_and_rivals():
    names, rivals = {of.name for of in problems()}, {rival.name for rival in RIVALS}
    for row in read(table.Row, page.RESULTS):
        assert row.problem in names
        assert row.rival in rivals


def test_the_drive_cycle_has_the_length_and_the_speed_that_the_agency_gives():
    rows = np.loadtxt(page.FOLDER / "data" / "udds.csv", delimiter=",", skiprows=1)
    assert rows[:, 0].tolist() == list(range(1370))
    assert rows[:, 1].max() == 56.7
    assert rows[:, 1].sum() / 3600 == pytest.approx(7.45, abs=0.005)
    (samples,) = problem("drive-cycle").task.samples
    assert samples.values[1:3] == pytest.approx(np.array([1.0, 4.3]) * 0.44704)
    assert samples.values[-1] == 0.0
