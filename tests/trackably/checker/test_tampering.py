"""Whatever is changed in a certificate, the checker refuses it or its statement is still true."""

from functools import partial

import numpy as np
import pytest

from tests.attack.bases import bases
from tests.attack.counts import Counts
from tests.attack.tampering import random_change
from trackably.certificates import cover, draft, prove
from trackably.checker import Proved, Refuted, check

CHANGES = {"bounds, boxes, numbers": 250, "pieces": 80, "formulas": 70, "counterexamples": 80}
"""How many are tried for each family of files; `make attack` goes on for longer."""


@pytest.fixture(scope="module")
def known():
    """Short Taylor polynomials: hundreds of certificates are to be checked."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (cover, draft, prove):
            patch.setattr(module, "TERMS", module.TERMS)  # `bases` sets a smaller number
        return bases()


@pytest.mark.parametrize(("family", "changes"), CHANGES.items())
def test_no_change_makes_it_prove_what_is_false(family, changes, known):
    found, rng, of_family = Counts(), np.random.default_rng(0), [base for base in known if base.family == family]
    assert all(isinstance(check(base.data), Proved | Refuted) for base in of_family)
    for i in range(changes):
        base = of_family[i % len(of_family)]
        what, other = random_change(base.data, rng)
        found.exact = i % 4 == 0
        found.attacked(what, other, partial(base.is_true, other))
    assert not found.false
    assert 0 < found.accepted < 0.4 * found.tried
