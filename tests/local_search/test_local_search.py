"""A plan is found wherever exact reachable intervals show one; where they show none, none is claimed."""

from collections import Counter

import numpy as np
import pytest

from tests.local_search.cases import ALPHAS, HORIZONS, cases, count
from tests.local_search.reachability import Sine


@pytest.mark.parametrize("horizon", HORIZONS)
def test_plans_are_found_where_there_are_any_and_claimed_nowhere_else(horizon):
    found = Counter[str]()
    for alpha in ALPHAS:
        for moving in (False, True):
            found += count(alpha, horizon, moving, states=1)
    impossible = 1 if horizon == 3 else 0
    assert found == Counter({"possible: Plan": 16 - impossible, "impossible: Infeasible": impossible})


def test_where_none_is_found_the_answer_says_what_was_searched():
    case = cases(0.6, 3, moving=True, states=1)[0]
    assert case.slack < -0.5
    assert "no plan was found that ends on the reference" in case.answer.explanation


@pytest.mark.parametrize("alpha", [0.1, 0.3, 0.8])
def test_reachable_intervals_are_those_of_a_grid(alpha):
    sine, rng = Sine(alpha), np.random.default_rng(1)
    for state in rng.uniform(-2, 2, 5):
        reached = np.array([state])
        for horizon in (1, 2, 3):
            ends = (sine.drift(reached)[:, None] + np.linspace(-1, 1, 201)).ravel()
            reached = np.linspace(ends.min(), ends.max(), 2001)
            inside = reached[np.abs(reached) <= sine.reach]
            if not inside.size:
                assert sine.slack(state, 0.0, horizon + 1) == -np.inf
                break
            for end, sign in ((inside[0], 1), (inside[-1], -1)):
                assert sine.slack(state, end + sign * 0.01, horizon) > 0
            assert sine.slack(state, reached[-1] + 0.01, horizon) < 0
            assert sine.slack(state, reached[0] - 0.01, horizon) < 0
            reached = inside
