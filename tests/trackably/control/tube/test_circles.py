"""Where the active-set method of SciPy does not end, something else finds the plan, and one kind of error is raised."""

import numpy as np
import pytest

from tests.trackably.control.tube.instances import LOOPS
from tests.trackably.control.tube.test_controller import off
from trackably.control.error_set import nearest_in
from trackably.control.stepping import Plan, Status


def circles(matrix, aim, *, maxiter) -> None:
    """What SciPy raises where steps are too few, which are 3 for each unknown if nothing is said."""
    assert maxiter > 3 * matrix.shape[1]
    raise RuntimeError("Maximum number of iterations reached.")


@pytest.mark.parametrize("name", ["three states", "three states, a hull"])
def test_where_the_active_set_method_goes_in_circles_the_interior_point_method_finds_the_optimum(name, monkeypatch):
    loop = LOOPS[name]
    starts = [off(loop, part) for part in np.geomspace(0.3, 2, 8)]
    plans = {
        i: plan for i, x in enumerate(starts) if isinstance(plan := loop.controller.step(0, x, loop.reference), Plan)
    }
    monkeypatch.setattr("scipy.optimize.nnls", circles)
    again = {i: loop.controller.step(0, starts[i], loop.reference) for i in plans}
    assert any(plan.status is Status.SOLVED for plan in again.values())
    for i, plan in again.items():
        assert isinstance(plan, Plan)
        assert plan.cost == pytest.approx(plans[i].cost, rel=1e-5, abs=1e-7)


def test_a_nearest_point_that_is_not_found_is_one_kind_of_error(monkeypatch):
    monkeypatch.setattr("scipy.optimize.nnls", circles)
    with pytest.raises(np.linalg.LinAlgError, match="the active-set method does not end in 60 steps"):
        nearest_in(np.eye(2), np.array([-1.0, -1.0]), np.zeros(2))
