"""Whatever is changed in a certificate, the checker refuses it or its statement is still true."""

from itertools import islice

import pytest

from tests.attack.bases import bases
from tests.attack.counts import Counts
from tests.trackably.checker.changes import tampered
from trackably.certificates import cover, draft, prove
from trackably.checker import Proved, Refuted, check

EVERY = {
    "bounds, boxes, numbers": 30,
    "pieces": 30,
    "formulas": 18,
    "counterexamples": 60,
}
"""Of how many changes one is tried, for each family of files; `make attack` goes on for longer."""


@pytest.fixture(scope="module")
def known():
    """Short Taylor polynomials: a thousand certificates are to be checked."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (cover, draft, prove):
            patch.setattr(module, "TERMS", module.TERMS)  # `bases` sets a smaller number
        return bases()


@pytest.mark.parametrize(("family", "every"), EVERY.items())
def test_no_change_makes_it_prove_what_is_false(family, every, known):
    found = Counts()
    for base in (base for base in known if base.family == family):
        assert isinstance(check(base.data), Proved | Refuted)
        for i, (what, other) in enumerate(islice(tampered(base.data), 0, None, every)):
            found.exact = i % 4 == 0
            found.attacked(what, other, lambda other=other, is_true=base.is_true: is_true(other))
    assert not found.false
    assert 0 < found.accepted < 0.4 * found.tried
