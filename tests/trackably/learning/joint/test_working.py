"""Working sets and early ends of the exchange: the same function with fewer rows, and nothing but lower bounds of D."""

import numpy as np
import pytest

from tests.trackably.learning.joint.instances import ALL, CASES, PINNED, Case, solved
from trackably.learning.joint.bent import bent_by
from trackably.learning.joint.learn import learn_jointly
from trackably.learning.joint.places import LOWER, UPPER, Places, chosen, demands, flags
from trackably.learning.joint.settle import no_places, settled
from trackably.learning.joint.working import WorkingSet
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
    found, whole = working.bent(case.posterior), bent_by(case.posterior, demanded)
    assert found.price == pytest.approx(whole.price, rel=1e-6)
    assert np.sum(working.chosen) < len(demanded.limits) / 2
    missed = (demanded.limits - demanded.rows.values(found.signals)) / demanded.widths
    assert np.max(missed) <= 1e-6
    again = working.bent(case.posterior)
    assert again.price == pytest.approx(found.price, rel=1e-10)


def test_some_exchanges_end_early():
    halves = [settled(c.problem, c.posterior, no_places(c.problem), tolerance=1e-2).rounds for c in CASES.values()]
    assert sum(halves) < sum(solved(name).rounds for name in CASES)


@pytest.mark.parametrize("name", CASES)
def test_an_exchange_that_ends_early_tells_a_lower_bound(name):
    """D of a relaxation is never larger, and the whole price is nearly there when little is missed."""
    case, whole = CASES[name], solved(name)
    nearly = settled(case.problem, case.posterior, no_places(case.problem), tolerance=1e-2)
    assert nearly.rounds <= whole.rounds
    assert nearly.margin >= -1e-2
    assert nearly.bent.price <= whole.bent.price * (1 + 1e-7)
    cheap = settled(case.problem, case.posterior, no_places(case.problem), ceiling=0.1 * whole.bent.price)
    assert cheap.rounds <= whole.rounds
    assert 0.1 * whole.bent.price < cheap.bent.price <= whole.bent.price * (1 + 1e-7)


@pytest.mark.parametrize("name", CASES)
def test_the_active_places_are_those_with_a_multiplier(name):
    found = solved(name)
    assert sum(map(len, found.active)) == np.count_nonzero(found.bent.multipliers) > 0


def test_flags_choose_the_places_that_they_stand_for():
    places = many_places(CASES["axis"])
    some = tuple(of_constraint[i::3] for i, of_constraint in enumerate(places))
    again = chosen(places, flags(places, some))
    for one, other in zip(some, again, strict=True):
        np.testing.assert_array_equal(one, other)


def test_given_values_that_no_function_has_are_refused(monkeypatch):
    """θ alone has a solution here, without the given values: it is no answer."""
    monkeypatch.setattr("trackably.learning.joint.search.settled", lambda *_: None)
    problem = PINNED["one_pin"].problem
    found = learn_jointly(problem)
    assert isinstance(found, NoFunction)
    assert f"state = {problem.pins[0].value:.6g} at t = 0.5 s" in found.explanation
