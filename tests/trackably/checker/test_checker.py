"""The checker: that it stands alone, and what it proves and refuses."""

import pytest
from mpmath import mp

from tests.trackably.certificates import naive
from tests.trackably.checker.changes import changed
from tests.trackably.checker.instances import scalar_certificate
from trackably.checker import Failed, check
from trackably.checker.intervals import iv


@pytest.fixture
def data() -> dict:
    return scalar_certificate()


@pytest.mark.parametrize("name", ["state", "input"])
def test_a_refusal_tells_which_bound_it_is_about(data: dict, name: str) -> None:
    verdict = check(changed(data, f"evaluation.errors.{name}", 1e-300))
    assert isinstance(verdict, Failed)
    assert verdict.bound == name


@pytest.mark.parametrize(("side", "factor"), [("input", 1e-300), ("state", 1e300)])
def test_rows_of_extreme_sizes_are_refused(data, side, factor):
    """A bound is called by its row, in covers and errors too."""
    called, found = f"{factor:.3g}{side}", changed(data, f"reference.plant.{side}_set.rows.0", [factor])
    for names in (found["claim"]["covers"], found["evaluation"]["errors"]):
        names[called] = names.pop(side)
    verdict = check(found)
    assert isinstance(verdict, Failed)
    assert verdict.reason.startswith("sizes")


def test_it_does_not_touch_the_precision_of_mpmath(data):
    before = mp.prec
    check(data)
    assert mp.prec == before
    assert iv.prec > naive.DIGITS
