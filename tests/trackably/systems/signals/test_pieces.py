"""What is no signal of polynomial pieces is refused; `test_precise.py` has the values of those that are."""

import numpy as np
import pytest

from trackably.systems.pieces import PolynomialPieces

LATER = {0.0: 1.0, 0.5: 2.0}
REFUSED = {
    "one breakpoint": (lambda: PolynomialPieces([0.0], []), ValueError, "breakpoints must be two"),
    "other shapes": (lambda: PolynomialPieces([0.0, 1.0], [[1.0], [2.0]]), ValueError, r"got shape \(2, 1\)"),
    "infinite": (lambda: PolynomialPieces([0.0, 1.0], [[np.inf]]), ValueError, "must be finite"),
    "beyond": (lambda: PolynomialPieces([0.0, 1.0], [[1.0]], "for ever"), ValueError, "one of rest, period, end"),
    "no exact period": (lambda: PolynomialPieces([0.1, 1.3], [[1.0]], "period"), ValueError, "must be exact"),
    "falling": (lambda: PolynomialPieces.steps({1.0: 0.0, 0.5: 1.0}), ValueError, "increasing times"),
    "a text": (lambda: PolynomialPieces.lines({0.0: "high"}), TypeError, "value: expected a number, got 'high'"),
    "a list": (lambda: PolynomialPieces.steps([0.0, 1.0]), TypeError, "expected values by their times"),
    "no period": (lambda: PolynomialPieces.lines(LATER, 0.0), ValueError, "period must be positive, got 0"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_signal_is_refused_in_a_sentence(name):
    make, error, said = REFUSED[name]
    with pytest.raises(error, match=f"^pieces: .*{said}"):
        make()
