"""A comparison that fails is a row that says so, and what was measured before it is not lost."""

import numpy as np
import pytest

from benchmarks import report
from benchmarks.harness import Disagreement, Row, agree, duel, no_worse


def nothing() -> None:
    pass


def compared(**options) -> Row:
    return duel("topic", "problem", "rival", nothing, options.pop("theirs", nothing), rounds=1, target=2.0, **options)


def broken() -> None:
    raise RuntimeError("solver\nfailed")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"theirs": broken}, "RuntimeError: solver failed"),
        ({"check": lambda: agree("last step", 130, 112, 0.0)}, "Disagreement: last step: 130 and 112 differ"),
    ],
)
def test_a_rival_that_fails_or_disagrees_is_a_row_that_says_so(options, sentence):
    row = compared(**options)
    assert row.verdict == "failed"
    assert row.failure.startswith(sentence)
    table = report.table([row, compared()], {})
    assert f"**failed**; {sentence}" in table
    assert f"- topic, problem, beside rival: {sentence}" in table


def test_a_rival_may_end_at_something_worse_but_not_at_something_better_or_at_nothing():
    no_worse("l", 71.3, 121.3, 1e-6)
    for theirs in (70.0, np.inf, np.nan):
        with pytest.raises(Disagreement, match="is worse than"):
            no_worse("l", 71.3, theirs, 1e-6)


def test_a_bar_in_a_name_is_no_border_of_a_cell():
    assert r"| breathing, \|v\| ≤ 5 | rival |" in report.table([Row("topic", "breathing, |v| ≤ 5", "rival")], {})
