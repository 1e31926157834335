"""What is certain of polynomials that rivals hand out: naive evaluation at dense times says the same."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from benchmarks.rivals.curves import stepping
from benchmarks.rivals.judge import Curve, tracing
from benchmarks.rivals.problems import problem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import Polytope


def random_pieces(seed: int, count: int = 5, degree: int = 4) -> PolynomialPieces:
    rng = np.random.default_rng(seed)
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, count))])
    return PolynomialPieces(breaks, rng.standard_normal((count, degree + 1)))


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


def test_a_sequence_is_broken_by_what_its_worst_step_breaks():
    of = problem("example1")
    plant, states, inputs = of.task.plant, np.zeros((301, 1)), np.zeros((300, 1))
    assert stepping(states, inputs, of).violation(of.window).most == 0.0
    states[70] = plant.state_set.upper + 0.1
    broken = stepping(states, inputs, of).violation(of.window)
    assert broken.least == pytest.approx(0.1 / (plant.state_set.upper - plant.state_set.lower).item(), rel=1e-6)
    assert broken.least <= broken.most
    assert (broken.quantity, broken.time) == ("state", pytest.approx(0.7))
