"""Which boxes a proof consists of: no narrower than needed far from all centres, halves of halves everywhere."""

import numpy as np
import pytest

from tests.trackably.certificates.instances import case, general_case
from tests.trackably.certificates.test_prove import reference
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove, prove_on_window
from trackably.checker import Proved, check
from trackably.gp.kernels.squared_exponential import SquaredExponential


def covered(end: float) -> list[np.ndarray]:
    found = prove_on_window(reference(SquaredExponential(1.0, 0.7)), 0.0, end)
    assert isinstance(found, Certificate), found.explanation
    return [np.array(cover.ends) for cover in found.covers.values()]


def test_boxes_far_from_all_centres_stay_wide():
    for ends in covered(1e6):
        assert len(ends) < 100
        assert np.max(np.diff(ends)) > 1e5


def test_boxes_are_halves_of_halves():
    end = 16.0
    for ends in covered(end):
        parts = end / np.diff(ends)
        np.testing.assert_array_equal(parts, 2.0 ** np.round(np.log2(parts)))
        np.testing.assert_array_equal(ends[:-1] % np.diff(ends), 0)


@pytest.mark.parametrize("make", [case, general_case])
def test_what_is_likely_is_proved_where_it_would_be_anyway(make):
    """Bounds are kept or broken by a hair: who is believed to keep them is checked no less."""
    for seed in range(9300, 9350):
        tried = make(seed).reference
        likely, anyway = prove(tried, is_likely=True), prove(tried)
        assert type(likely) is type(anyway)
        if isinstance(likely, Certificate) and isinstance(anyway, Certificate):
            assert type(likely.claim) is type(anyway.claim)
            assert isinstance(check(encode_certificate(likely)), Proved)
