"""Figures: what they mark and name. That they are the same bytes each time is seen where stages draw all of them."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline.drawings import algorithm1, references
from pipeline.drawings.algorithm1 import evaluate_on_grid
from pipeline.drawings.style import axis_label, svg
from tests.pipeline.committed import EXPERIMENTS, fitted
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import Steps
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace

FITTED = fitted("example1")
SAMPLES = FITTED.sampled.only
STATE, INPUT = EXPERIMENTS["example1"].plant.quantities


def drawn_path() -> Figure:
    found = fitted("vehicle")
    shown = {name: found.learned[name].reference for name in ("unconstrained", "joint")}
    return references.path(shown, ("x", "y"), np.linspace(0, 12, 301), found.sampled.samples, None, {})


def test_what_the_unconstrained_path_breaks_is_marked_and_nothing_else() -> None:
    (axes,) = drawn_path().axes
    lines = {str(line.get_label()): np.asarray(line.get_xydata()) for line in axes.lines}
    marked = [label for label in lines if "unconstrained)" in label]
    assert marked
    for label in marked:
        of_marks = np.isfinite(lines[label][:, 0])
        assert 0 < np.sum(of_marks) < len(of_marks)
    assert not any("joint)" in label for label in lines)
    assert axes.get_aspect() == 1.0


def test_the_sessions_own_style_neither_shows_nor_changes() -> None:
    def drawn() -> bytes:
        return svg(algorithm1.tube(FITTED.learned["sound"].reference, np.arange(12)))

    expected = drawn()
    assert b"<text" not in expected, "letters are paths, so that fonts do not matter"
    with mpl.rc_context({"font.size": 30, "lines.linewidth": 9}):
        assert drawn() == expected
        assert mpl.rcParams["font.size"] == 30


def problem(noise_std: float) -> ConstrainedProblem:
    prior = JointPrior((Prior(SquaredExponential(0.7, 0.22).as_learned(), noise_std),))
    constraints = (Constraint(STATE, Steps(0, 130, 0.01)), Constraint(INPUT, Steps(0, 129, 0.01)))
    return ConstrainedProblem((SAMPLES,), prior, SearchSpace.around((SAMPLES,), prior), constraints)


def test_a_landscape_agrees_with_the_problem_and_what_cannot_be_factored_is_not_a_number() -> None:
    of, first, k = problem(0.01), np.array([0.5, 1.1]), np.arange(131) * 0.01
    bounded = [(constraint.quantity, k[: 131 - n]) for n, constraint in enumerate(of.constraints)]
    grid = evaluate_on_grid(of, first, np.array([0.15]))
    for j, posterior in enumerate(of.posterior(np.log([each, 0.15])) for each in first):
        margins = [np.min(q.margin(posterior.signals, times)) / q.bounds.width for q, times in bounded]
        assert grid.objective[0, j] == posterior.negative_log_marginal_likelihood()[0]
        assert grid.margin[0, j] == pytest.approx(min(margins), abs=1e-14)
    lost = evaluate_on_grid(problem(1e-12), np.array([1.0]), np.array([0.1, 1e4]))
    assert np.isfinite(lost.objective).ravel().tolist() == [True, False]


UNITS = {"vx": "m/s", "vy": "m/s", "x": "m", "q[1]": "rad", "flow_in": "m³/s"}
LABELS = {
    "q[1]": "q[1] [rad]",
    "flow_in": "flow in [m³/s]",
    "vx-0.5*vy": "vx-0.5*vy [m/s]",
    "vx (2)": "vx (2) [m/s]",
    "x+vx": "x+vx",
    "z": "z",
}


@pytest.mark.parametrize("name", LABELS)
def test_a_unit_is_written_where_all_terms_have_it(name: str) -> None:
    assert axis_label(name, UNITS) == LABELS[name]
