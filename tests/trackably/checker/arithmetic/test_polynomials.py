"""Polynomials that are said to stay between two numbers do, whatever their coefficients' intervals hold."""

from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from trackably.checker import boxes
from trackably.checker.boxes import Box, stays_inside
from trackably.checker.intervals import Real, between, exactly
from trackably.checker.models import Model
from trackably.checker.moving import Limit
from trackably.checker.subject import Pieces

BOX = Box(0.0, 1.0, 1.0)


def wrongly_inside(seed: int) -> int:
    """How often a model is said to be inside bounds that some function of it leaves, by a hair or by nothing."""
    draw, wrong = np.random.default_rng(seed), 0
    n = int(draw.integers(1, 9))
    middles = draw.standard_normal(n) * draw.choice([1.0, 1e-8, 2.0**-330], n)
    radii = np.abs(middles) * draw.choice([0.0, 1e-3, 1e-12, 2.0**-50], n)
    ends = [(float(m - r), float(m + r)) for m, r in zip(middles, radii, strict=True)]
    missed = float(draw.choice([0.0, 1e-9, 0.25]))
    model = Model([between(*end) for end in ends], exactly(missed))
    x = Fraction(int(draw.integers(-8, 9)), 8)
    sides = [[max((Fraction(end) * x**k * sign, k) for end in of)[0] for k, of in enumerate(ends)] for sign in (1, -1)]
    most, least = sum(sides[0]) + Fraction(missed), -sum(sides[1]) - Fraction(missed)
    for by in (Fraction(0), Fraction(1, 2**290), Fraction(1, 10**9)):
        for low, high in ((least - 100, most - by), (least + by, most + 100)):
            of_bound: Any = SimpleNamespace(lower=through(x, low, draw), upper=through(x, high, draw))
            wrong += stays_inside(model, of_bound, BOX) and not (low <= least and most <= high)
    return wrong


def through(x: Fraction, value: Fraction, draw: np.random.Generator) -> Limit:
    """An end of a bound that is constant or moves, and has this value at x in the box."""
    slope = float(draw.choice([0.0, 1.0, -3.0]))
    line, (start, end) = Pieces((BOX.start, BOX.end), ((0.0, slope),), "end"), map(Fraction, (BOX.start, BOX.end))
    return Limit(line, interval(value - Fraction(slope) * (1 + x) * (end - start) / 2))


def interval(number: Fraction) -> Real:
    return exactly(number.numerator) / exactly(number.denominator)


def test_no_model_is_inside_bounds_that_one_of_its_functions_leaves() -> None:
    assert not any(wrongly_inside(seed) for seed in range(300))


FAULTS = {
    "middles alone": (
        "in_fixed_point",
        lambda real: lambda of: real(of) and [((a + b) // 2,) * 2 for a, b in real(of)],
    ),
    "moved the wrong way": ("shift", lambda real: lambda p, by: real(p, -by)),
    "not moved": ("shift", lambda real: lambda p, by: list(p)),
    "a little room is added": ("is_nowhere_negative", lambda real: lambda p: real([p[0] + abs(p[0]) // 2**40, *p[1:]])),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_seen(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    name, made = FAULTS[fault]
    monkeypatch.setattr(boxes, name, made(getattr(boxes, name)))
    assert any(wrongly_inside(seed) for seed in range(300))
