import numpy as np
import pytest

from benchmarks.rivals import page, table
from benchmarks.rivals.adapters import fine_grid
from benchmarks.rivals.adapters.rows import Grid, evenly
from benchmarks.rivals.curves import curve_of
from benchmarks.rivals.page import RIVALS
from benchmarks.rivals.problems import problem
from benchmarks.rivals.table import objective_of
from benchmarks.rivals.tables import read
from trackably.gp.row_posterior import RowPosterior
from trackably.learning.joint.dual import solve_dual


def test_the_violation_of_an_unconstrained_mean_is_what_dense_times_show():
    of = problem("example1")
    curve = curve_of(of.likeliest.posterior.signals, of)
    violation = curve.violation(of.window)
    t, reference = np.linspace(*of.window, 10_001), curve.reference
    dense = max(float(np.max(-q.margin(reference.signals, t))) / q.bounds.width for q in reference.quantities)
    assert dense == pytest.approx(0.0203, abs=1e-4)
    assert violation.least == pytest.approx(dense, rel=1e-6)
    assert violation.least <= violation.most <= 1.001 * violation.least
    assert violation.quantity == "state"


def test_the_fine_grid_has_the_minimum_that_the_dual_program_has():
    of = problem("example1")
    answer, posterior, grid = fine_grid.solve(of), of.likeliest.posterior, Grid.of(of, evenly(of, 200))
    given = RowPosterior(posterior, grid.rows)
    rows = np.vstack([np.eye(len(grid.rows)), -np.eye(len(grid.rows))])
    demand = np.concatenate([grid.lower - given.mean, given.mean - grid.upper])
    dual = solve_dual(rows @ given.covariance @ rows.T, demand, np.zeros(len(demand), dtype=bool))
    least = posterior.negative_log_marginal_likelihood()[0]
    assert answer.objective - least == pytest.approx(dual.value, rel=1e-4)
    assert objective_of(of, answer) == pytest.approx(answer.objective, abs=1e-5)


@pytest.mark.filterwarnings("ignore")  # of the rivals
@pytest.mark.parametrize("rival", RIVALS, ids=lambda rival: rival.name)
def test_a_rival_does_what_its_committed_row_says(rival):
    """All but the library's own two leave bounds between the places where they look, or cost more, or say no."""
    for package in rival.needs:
        pytest.importorskip(package)
    (said,) = (row for row in read(table.Row, page.RESULTS) if (row.problem, row.rival) == ("axis", rival.name))
    row = table.measured(problem("axis"), rival)
    assert (row.answer, row.says, row.quantity, row.places) == (said.answer, said.says, said.quantity, said.places)
    for name, rounding in {"objective": 0.0, "J": 0.0, "misfit": 0.0, "least": 1e-5}.items():
        found, wanted = getattr(row, name), getattr(said, name)
        assert found == wanted if wanted is None else found == pytest.approx(wanted, rel=0.01, abs=rounding), name
