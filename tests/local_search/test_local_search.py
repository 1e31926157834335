"""A plan is found wherever exact reachable intervals show one; where they show none, none is claimed."""

from collections import Counter

import pytest

from tests.local_search.cases import ALPHAS, HORIZONS, cases, count


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
