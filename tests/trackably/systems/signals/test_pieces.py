"""What is no signal of polynomial pieces is refused; `test_precise.py` has the values of those that are."""

import numpy as np
import pytest

from trackably.systems.pieces import PolynomialPieces

REFUSED = {
    "infinite": (lambda: PolynomialPieces([0.0, 1.0], [[np.inf]]), "must be finite"),
    "no exact period": (lambda: PolynomialPieces([0.1, 1.3], [[1.0]], "period"), "must be exact"),
    "falling": (lambda: PolynomialPieces.steps({1.0: 0.0, 0.5: 1.0}), "increasing times"),
    "no period": (lambda: PolynomialPieces.lines({0.0: 1.0, 0.5: 2.0}, 0.0), "period must be positive, got 0"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_signal_is_refused_in_a_sentence(name):
    make, said = REFUSED[name]
    with pytest.raises(ValueError, match=f"^pieces: .*{said}"):
        make()
