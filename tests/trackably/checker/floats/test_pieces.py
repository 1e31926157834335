"""In float64, bounds of polynomial pieces are kept where extremes found otherwise keep them, and nowhere else."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tests.splines.draws import from_scipy
from tests.splines.naive import extremes
from tests.trackably.plants import AXIS
from trackably.certificates.form import encode_subject
from trackably.checker.floats.boxes import FIRST_PASS
from trackably.checker.form import subject_of
from trackably.checker.quantities import functionals
from trackably.systems.reference import Reference

KINDS = {"rest": "clamped", "period": "periodic", "end": "natural"}


def drawn(beyond: str, seed: int) -> Reference:
    """The axis follows a spline through random points at random times."""
    draw = np.random.default_rng(seed)
    times, values = np.cumsum(draw.integers(7, 64, 8)) / 64, draw.uniform(-1.0, 1.0, 8)
    values[-1] = values[0]
    return Reference((from_scipy(CubicSpline(times, values, bc_type=KINDS[beyond]), beyond),), AXIS)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("beyond", KINDS)
def test_bounds_next_to_the_extremes_are_kept_and_bounds_inside_of_them_never(beyond: str, seed: int) -> None:
    reference = drawn(beyond, seed)
    breakpoints = reference.pieces[0].breakpoints
    start, end = Fraction(0), Fraction(float(breakpoints[-1]) - (0.3 if beyond == "end" else 0.0))
    if beyond == "end":
        start = Fraction(float(breakpoints[0]) + 0.01)
    found = [extremes(q.functional, reference.pieces, start, end) for q in reference.quantities]
    exact = [(Fraction(float(low)), Fraction(float(high))) for low, high in found]
    subject = subject_of(encode_subject(reference))

    def kept(by_low: float, by_high: float) -> set[int]:
        ends = [
            (low - Fraction(by_low) * (1 + abs(low)), high + Fraction(by_high) * (1 + abs(high))) for low, high in exact
        ]
        return FIRST_PASS.pieces(subject, ends, start, end)

    assert kept(1e-6, 1e-6) == {0, 1, 2}
    for by in (2.0**-50, 1e-12, 1e-6):
        assert kept(-by, 1.0) == kept(1.0, -by) == set()
    assert kept(-0.1, -0.1) == set()


def test_a_value_that_begins_at_the_end_of_the_claim_counts() -> None:
    pieces = from_scipy(CubicSpline([0.0, 1.0, 2.0], [0.0, 0.0, 0.0]), "end")
    jump = replace(pieces, coefficients=np.array([[0.0] * 4, [5.0, 0.0, 0.0, 0.0]]))
    subject = subject_of(encode_subject(Reference((jump,), AXIS)))
    last = max(j for j, w in enumerate(functionals(subject, "state")[0].weights[0]) if w)
    end, small, large = 1 - last * Fraction(AXIS.system.sampling_time), Fraction(1, 1000), Fraction(10**9)
    ends = [(-small, small), (-large, large), (-large, large)]
    assert FIRST_PASS.pieces(subject, ends, Fraction(0), end - Fraction(1, 64)) == {0, 1, 2}
    assert FIRST_PASS.pieces(subject, ends, Fraction(0), end) == {1, 2}
