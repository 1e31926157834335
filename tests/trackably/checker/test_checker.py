"""What the checker answers of bounds, and what it leaves alone."""

import pytest
from mpmath import mp

from tests.trackably.certificates import naive
from tests.trackably.checker.changes import changed
from tests.trackably.checker.instances import scalar_certificate
from trackably.checker import Failed, check
from trackably.checker.intervals import iv


@pytest.mark.parametrize("name", ["state", "input"])
def test_a_refusal_tells_which_bound_it_is_about(name):
    verdict = check(changed(scalar_certificate(), f"evaluation.errors.{name}", 1e-300))
    assert isinstance(verdict, Failed)
    assert verdict.bound == name


@pytest.mark.parametrize(("side", "factor"), [("input", 1e-300), ("state", 1e300)])
def test_rows_of_extreme_sizes_are_refused(side, factor):
    """A bound is called by its row, in covers and errors too."""
    found = changed(scalar_certificate(), f"reference.plant.{side}_set.rows.0", [factor])
    for names in (found["claim"]["covers"], found["evaluation"]["errors"]):
        names[f"{factor:.3g}{side}"] = names.pop(side)
    assert check(found).reason.startswith("sizes")


def test_it_does_not_touch_the_precision_of_mpmath():
    before = mp.prec
    check(scalar_certificate())
    assert mp.prec == before
    assert iv.prec > naive.DIGITS
