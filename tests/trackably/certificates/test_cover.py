"""Which boxes a proof consists of: no narrower than needed far from all centres, halves of halves everywhere."""

import pytest

from tests.trackably.certificates.instances import case, general_case
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
from trackably.checker import Proved, check


@pytest.mark.parametrize("make", [case, general_case])
def test_what_is_likely_is_proved_where_it_would_be_anyway(make):
    """Bounds are kept or broken by a hair: who is believed to keep them is checked no less."""
    for seed in range(9300, 9306):
        tried = make(seed).reference
        likely, anyway = prove(tried, is_likely=True), prove(tried)
        assert type(likely) is type(anyway)
        if isinstance(likely, Certificate) and isinstance(anyway, Certificate):
            assert type(likely.claim) is type(anyway.claim)
            assert isinstance(check(encode_certificate(likely)), Proved)
