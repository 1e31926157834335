"""Bounds of polynomial pieces are kept where extremes found otherwise keep them, and nowhere else."""

from fractions import Fraction
from functools import cache

import numpy as np
import pytest

from tests.splines.draws import cubic, from_scipy
from tests.splines.naive import extremes
from tests.trackably.plants import AXIS
from trackably.certificates.form import encode_subject
from trackably.checker import piecewise
from trackably.checker.form import subject_of
from trackably.checker.piecewise import keeps, row_of, values_at
from trackably.checker.quantities import functionals
from trackably.checker.subject import Subject
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference


@cache
def drawn(beyond: str, seed: int) -> Reference:
    """The axis follows a spline through random points at random times."""
    draw = np.random.default_rng(seed)
    times, values = np.cumsum(draw.integers(7, 64, 8)) / 64, draw.uniform(-1.0, 1.0, 8)
    values[-1] = values[0]
    return Reference((from_scipy(cubic(times, values, beyond), beyond),), AXIS)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("beyond", ["rest", "period", "end"])
def test_bounds_next_to_the_extremes_are_kept_and_bounds_inside_of_them_never(beyond: str, seed: int) -> None:
    reference = drawn(beyond, seed)
    first, last = (Fraction(float(t)) for t in reference.pieces[0].breakpoints[[0, -1]])
    start, end = (first + Fraction(1, 64), last - Fraction(5, 16)) if beyond == "end" else (Fraction(0), last)
    found = [extremes(q.functional, reference.pieces, start, end) for q in reference.quantities]
    exact = [(Fraction(float(low)), Fraction(float(high))) for low, high in found]

    def are_kept(*by: float) -> list[bool]:
        rooms = [[Fraction(part) * (1 + abs(at)) for part, at in zip(by, ends, strict=True)] for ends in exact]
        ends = [(low - below, high + above) for (low, high), (below, above) in zip(exact, rooms, strict=True)]
        return kept(subject_of(encode_subject(reference)), ends, start, end)

    assert all(are_kept(1e-6, 1e-6))
    for by in (2.0**-50, 1e-12, 1e-6):
        assert not any(are_kept(-by, 1.0) + are_kept(1.0, -by))


def kept(subject: Subject, ends: list[tuple[Fraction, Fraction]], start: Fraction, end: Fraction) -> list[bool]:
    """Which bounds are kept between these ends."""
    rows = [row_of(subject, bound) for bound in subject.bounds]
    return [keeps(subject, row, (start, end), of) for row, of in zip(rows, ends, strict=True)]


SIZES = (1.0, 1e-9, 1e9, 1e-30, 1e30)


def a_subject(draw: np.random.Generator, sizes: tuple[float, ...]) -> Subject:
    """A subject whose one signal has pieces of these sizes, of any degree up to 7."""
    n, count = int(draw.integers(1, 9)), 6
    times = np.cumsum(draw.uniform(0.01, 2.0, count + 1)) - 3.0
    coefficients = draw.standard_normal((count, n)) * draw.choice(sizes, (count, n))
    return subject_of(encode_subject(Reference((PolynomialPieces(times, coefficients, "end"),), AXIS)))


def wrongly_kept(seed: int) -> int:
    """How often a row is said to be kept between ends that it leaves; ends are at a value, or a hair beside it."""
    draw, wrong = np.random.default_rng(seed), 0
    subject = a_subject(draw, SIZES if seed % 2 else (1.0,))
    start, end = (Fraction(subject.pieces[0].breakpoints[k]) for k in (0, 3))
    for row in [row_of(subject, bound) for bound in subject.bounds]:
        for part in draw.integers(0, 65, 4).tolist():
            t = start + (end - start) * Fraction(part, 64)
            (value,) = values_at(subject, [row], t)
            by = abs(value) * Fraction(draw.choice([2.0**-300, 2.0**-50])) + Fraction(2.0**-1000)
            around, far = (t - (t - start) / 2, t + (end - t) / 2), 10 * abs(value) + 1
            for ends in ((value - far, value - by), (value + by, value + far)):
                wrong += keeps(subject, row, around, ends)
    return wrong


def test_no_row_is_kept_of_which_a_value_is_outside_whatever_sizes_numbers_have() -> None:
    assert not any(wrongly_kept(seed) for seed in range(20))


FAULTS = {
    "the last coefficient is lost": ("compose", lambda real: lambda p, *of: [*real(p, *of)[:-1], 0]),
    "times are rounded": ("place", lambda real: lambda *of: (real(*of)[0], real(*of)[1] >> 9 << 9, real(*of)[2])),
    "negative values are overlooked": ("is_nowhere_negative", lambda real: lambda p: real([abs(p[0]), *p[1:]])),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_seen(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    name, made = FAULTS[fault]
    monkeypatch.setattr(piecewise, name, made(getattr(piecewise, name)))
    assert any(wrongly_kept(seed) for seed in range(20))


def test_a_value_that_begins_at_the_end_of_the_claim_counts() -> None:
    jump = PolynomialPieces([0.0, 1.0, 2.0], [[0.0], [5.0]], "end")
    subject = subject_of(encode_subject(Reference((jump,), AXIS)))
    last = max(j for j, w in enumerate(functionals(subject, "state")[0].weights[0]) if w)
    end, small, large = 1 - last * Fraction(AXIS.system.sampling_time), Fraction(1, 1000), Fraction(10**9)
    ends = [(-small, small), (-large, large), (-large, large)]
    assert kept(subject, ends, Fraction(0), end - Fraction(1, 64)) == [True, True, True]
    assert kept(subject, ends, Fraction(0), end) == [False, True, True]
