"""The time from which an envelope is proved is the one that ball arithmetic alone finds, with fewer proofs."""

import numpy as np
import pytest

from tests.trackable.certificates.instances import case, general_case
from tests.trackable.certificates.test_prove import reference
from tests.trackable.gp.instances import RADIAL
from trackable.certificates import settled
from trackable.certificates.settled import earliest_settled


def found(of, monkeypatch) -> tuple[list[float | None], list[int]]:
    """The time with a search in float64 and without one, and the number of proofs."""
    times, counts, right = [], [], settled.settled_margins
    reserve = {q.name: 1e-9 for q in of.quantities}
    for guess in (settled.nearly_settled, lambda *_: None):
        calls = []
        with monkeypatch.context() as patch:
            patch.setattr(settled, "nearly_settled", guess)
            patch.setattr(settled, "settled_margins", lambda *a, calls=calls: calls.append(1) or right(*a))
            times.append(earliest_settled(of, reserve, {}))
        counts.append(len(calls))
    return times, counts


@pytest.mark.parametrize("kernel", RADIAL.values(), ids=RADIAL)
def test_it_is_the_same_time_for_every_kernel(kernel, monkeypatch):
    (nearly, exactly), (few, many) = found(reference(kernel), monkeypatch)
    assert nearly == exactly
    assert nearly is None or few == 1 < many


@pytest.mark.parametrize("seed", range(8))
def test_it_is_the_same_time_for_every_system(seed, monkeypatch):
    for make in (case, general_case):
        (nearly, exactly), _ = found(make(8100 + seed).reference, monkeypatch)
        assert nearly == exactly


def test_a_guess_that_is_wrong_is_not_believed(monkeypatch):
    of = reference(RADIAL["matern52"])
    (_, exactly), _ = found(of, monkeypatch)
    monkeypatch.setattr(settled, "nearly_settled", lambda *_: lambda start: True)
    reserve = {q.name: 1e-9 for q in of.quantities}
    time = earliest_settled(of, reserve, {})
    assert time == exactly
    assert min(settled.settled_margins(of, settled.arb(time), reserve, {}).values()) >= 0
    assert np.isfinite(time)
