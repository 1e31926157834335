from functools import cache

import numpy as np
import pytest

from benchmarks.rivals import figures, page, table
from benchmarks.rivals.adapters import fine_grid, ours, tightened
from benchmarks.rivals.adapters.rows import Grid
from benchmarks.rivals.entries import RIVALS
from benchmarks.rivals.judge.kernels import KernelCurve, widened
from benchmarks.rivals.model import Found, NotFound, Promise, Rival
from benchmarks.rivals.objective import objective_of
from benchmarks.rivals.problems import problem, problems
from benchmarks.rivals.study import summary as study
from trackably.gp.row_posterior import RowPosterior
from trackably.learning.joint.dual import solve_dual
from trackably.systems.reference import Reference


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
    posterior = of.likeliest.posterior
    curve = KernelCurve(Reference(posterior.signals, of.task.plant), of.task.samples)
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
    answer, posterior, grid = found(fine_grid.solve), of.likeliest.posterior, Grid.of(of, 200)
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


def test_the_steepness_of_a_stationary_kernel_is_that_of_its_definition():
    of = problem("example1")
    posterior, functional = of.likeliest.posterior, of.task.plant.quantities[0].functional
    kernel, half = posterior.prior.parts[0].kernel, 0.05
    assert tightened.steepness(posterior, functional, half) == pytest.approx(
        np.sqrt(2 * (kernel(np.zeros(())) - kernel(np.array(half)))), rel=1e-6
    )


def test_our_objective_of_a_posterior_mean_is_its_likelihood():
    answer = found(ours.HYPERPARAMETERS.solve)
    assert objective_of(problem("example1"), answer) == pytest.approx(answer.objective, abs=1e-6)


def test_a_rival_that_fails_is_a_row_that_says_so():
    rival = Rival("z", "nobody", Promise("", "nowhere"), lambda _: NotFound("infeasible", "there is no such curve"))
    row = table.measured(problem("example1"), rival)
    assert (row.answer, row.least) == ("infeasible", None)
    assert "there is no such curve" in table.page([row])


def test_rows_are_written_and_read(tmp_path):
    row = table.measured(problem("example1"), ours.JOINT)
    table.write([row], tmp_path / "rows.json")
    assert table.read(tmp_path / "rows.json") == [row]
    assert "**none: proved**" in table.page([row])


def test_every_rival_says_what_it_promises():
    assert len({rival.name for rival in RIVALS}) == len(RIVALS)
    for rival in RIVALS:
        assert rival.promise.source
        assert rival.promise.summary or rival.promise.quote


def test_committed_rows_are_of_known_problems_and_rivals():
    names, rivals = {of.name for of in problems()}, {rival.name for rival in RIVALS}
    for row in table.read(page.RESULTS):
        assert row.problem in names
        assert row.rival in rivals


def test_figures_show_every_rival_that_was_measured():
    finer, rows = table.read(page.SWEEP), table.read(page.RESULTS)
    for figure, names in (
        (figures.violations(finer), {row.rival for row in finer}),
        (figures.tightness(rows), {row.rival for row in rows if row.tightness is not None and row.error is not None}),
    ):
        assert {text.get_text() for text in figure.legends[0].get_texts()} == names


def test_the_figure_of_the_study_shows_every_rival_and_system():
    entries = study.read(page.STUDY)[-1]
    figure = figures.study(entries)
    assert {text.get_text() for text in figure.legends[0].get_texts()} == {entry.rival for entry in entries}
    titles = {axes.get_title(loc) for axes in figure.axes for loc in ("left", "center")} - {""}
    assert titles == {entry.system for entry in entries}


def test_wider_bounds_are_wider_by_the_part_that_was_asked_for():
    of = problem("vehicle")
    reference = Reference(of.likeliest.posterior.signals, of.task.plant)
    for before, after in zip(reference.quantities, widened(reference, 0.25).quantities, strict=True):
        assert after.bounds.lower == pytest.approx(before.bounds.lower - 0.25 * before.bounds.width)
        assert after.bounds.upper == pytest.approx(before.bounds.upper + 0.25 * before.bounds.width)


def test_the_drive_cycle_has_the_length_and_the_speed_that_the_agency_gives():
    rows = np.loadtxt(page.FOLDER / "data" / "udds.csv", delimiter=",", skiprows=1)
    assert rows[:, 0].tolist() == list(range(1370))
    assert rows[:, 1].max() == 56.7
    assert rows[:, 1].sum() / 3600 == pytest.approx(7.45, abs=0.005)
    (samples,) = problem("drive-cycle").task.samples
    assert samples.values[1:3] == pytest.approx(np.array([1.0, 4.3]) * 0.44704)
    assert samples.values[-1] == 0.0
