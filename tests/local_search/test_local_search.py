"""A plan is found wherever exact reachable intervals show one; where they show none, none is claimed."""

from collections import Counter

import pytest

from tests.local_search.cases import cases
from trackably.control.stepping import Infeasible, Plan


@pytest.mark.parametrize("horizon", [3, 10])
def test_plans_are_found_where_there_are_any_and_claimed_nowhere_else(horizon):
    found = Counter()
    for tenths in range(1, 9):
        for moving in (False, True):
            (case,) = cases(tenths / 10, horizon, moving, states=1)
            assert abs(case.slack) > 1e-6
            assert isinstance(case.answer, Plan if case.slack > 0 else Infeasible)
            found[case.slack > 0] += 1
    assert found[False] == (1 if horizon == 3 else 0)


def test_where_none_is_found_the_answer_says_what_was_searched():
    case = cases(0.6, 3, moving=True, states=1)[0]
    assert case.slack < -0.5
    assert "no plan was found that ends on the reference" in case.answer.explanation
