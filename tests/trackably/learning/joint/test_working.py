"""Working sets and early ends of the exchange: the same function with fewer rows, and nothing but lower bounds of D."""

import numpy as np
import pytest

from tests.trackably.learning.joint.instances import ALL, CASES, Case, solved
from trackably.learning.joint.constrained_mean import WorkingSet, mean_meeting
from trackably.learning.joint.exchange import exchange_bounds, no_places
from trackably.learning.joint.places import LOWER, UPPER, Places, demands

EVERY = 4  # steps

cases = pytest.mark.parametrize("name", ALL)


def many_places(case: Case) -> Places:
    """Both sides of every bound at every few steps."""
    times = case.times[::EVERY]
    sides = np.repeat([LOWER, UPPER], len(times))
    both = np.column_stack([np.tile(times, 2), sides])
    return tuple(both[np.lexsort(both.T[::-1])] for _ in case.problem.constraints)


@cases
def test_a_working_set_gives_the_function_of_all_rows(name):
    case = ALL[name]
    demanded = demands(case.problem, many_places(case), case.posterior.signals)
    working = WorkingSet(demanded, demanded.is_equation.copy())
    found, whole = working.mean_for(case.posterior), mean_meeting(case.posterior, demanded)
    assert found.price == pytest.approx(whole.price, rel=1e-6)
    assert np.sum(working.chosen) < len(demanded.limits) / 2
    missed = (demanded.limits - demanded.rows.values(found.signals)) / demanded.widths
    assert np.max(missed) <= 1e-6
    again = working.mean_for(case.posterior)
    assert again.price == pytest.approx(found.price, rel=1e-10)


@pytest.mark.parametrize("name", CASES)
def test_an_exchange_that_ends_early_tells_a_lower_bound(name):
    """D of a relaxation is never larger, and the whole price is nearly there when little is missed."""
    case, whole = CASES[name], solved(name)
    nearly = exchange_bounds(case.problem, case.posterior, no_places(case.problem), tolerance=1e-2)
    assert nearly.rounds <= whole.rounds
    assert nearly.margin >= -1e-2
    assert nearly.mean.price <= whole.mean.price * (1 + 1e-7)
    cheap = exchange_bounds(case.problem, case.posterior, no_places(case.problem), ceiling=0.1 * whole.mean.price)
    assert cheap.rounds <= whole.rounds
    assert 0.1 * whole.mean.price < cheap.mean.price <= whole.mean.price * (1 + 1e-7)
