"""Working sets and early ends of the exchange: the same function with fewer rows, and nothing but lower bounds of D."""

import numpy as np
import pytest

from tests.trackably.learning.joint.instances import ALL, CASES, PINNED, Case, solved
from trackably.learning.joint.constrained_mean import WorkingSet, mean_meeting
from trackably.learning.joint.exchange import exchange_bounds, no_places
from trackably.learning.joint.places import LOWER, UPPER, Places, chosen, demands, flags
from trackably.learning.joint.search import learn_jointly
from trackably.learning.problem import NoFunction

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


def test_some_exchanges_end_early():
    halves = [
        exchange_bounds(c.problem, c.posterior, no_places(c.problem), tolerance=1e-2).rounds for c in CASES.values()
    ]
    assert sum(halves) < sum(solved(name).rounds for name in CASES)


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


@pytest.mark.parametrize("name", CASES)
def test_the_active_places_are_those_with_a_multiplier(name):
    found = solved(name)
    assert sum(map(len, found.active)) == np.count_nonzero(found.mean.multipliers) > 0


def test_flags_choose_the_places_that_they_stand_for():
    places = many_places(CASES["axis"])
    some = tuple(of_constraint[i::3] for i, of_constraint in enumerate(places))
    again = chosen(places, flags(places, some))
    for one, other in zip(some, again, strict=True):
        np.testing.assert_array_equal(one, other)


def test_given_values_that_no_function_has_are_refused(monkeypatch):
    """θ alone has a solution here, without the given values: it is no answer."""
    monkeypatch.setattr("trackably.learning.joint.search.exchange_bounds", lambda *_: None)
    problem = PINNED["one_pin"].problem
    found = learn_jointly(problem)
    assert isinstance(found, NoFunction)
    assert f"state = {problem.pins[0].value:.6g} at t = 0.5 s" in found.explanation
