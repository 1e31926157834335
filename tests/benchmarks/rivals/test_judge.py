"""What is certain of polynomials that rivals hand out: naive evaluation at dense times says the same."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from benchmarks.rivals.judge import Curve, tracing
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import Polytope


def random_pieces(seed: int) -> PolynomialPieces:
    rng = np.random.default_rng(seed)
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, 5))])
    return PolynomialPieces(breaks, rng.standard_normal((5, 5)))


def bounded(of: PolynomialPieces, low: float, high: float) -> Curve:
    return tracing([of], ["x"], Polytope.box([low], [high]))


@pytest.mark.parametrize("seed", range(5))
def test_the_largest_violation_is_enclosed_and_named_and_is_what_dense_times_show(seed):
    of = random_pieces(seed)
    ends, parts = of.breakpoints, [Polynomial(c) for c in of.coefficients]
    seen = max(p(np.linspace(0, b - a, 4001)).max() for a, b, p in zip(ends[:-1], ends[1:], parts, strict=True))
    low, high = seen - 50.0, seen - 0.1
    found = bounded(of, low, high).violation((0.0, float(ends[-1])))
    assert found.least == pytest.approx(0.1 / (high - low), rel=1e-4)
    assert 0.1 / (high - low) - 1e-12 <= found.most <= found.least * (1 + 1e-3) + 1e-6
    assert (found.quantity, of(found.time)) == ("x", pytest.approx(seen, abs=1e-4))
    assert bounded(of, low, seen + 0.1).violation((0.0, float(ends[-1]))).most == 0.0
