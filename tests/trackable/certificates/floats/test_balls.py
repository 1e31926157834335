"""Float64 balls and their series hold what arb computes for numbers inside them; without rounding they do not."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from flint import arb, arb_series

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.floats import balls, series
from trackable.certificates.floats.balls import Balls, sums_up
from trackable.certificates.floats.choice import choose, zero
from trackable.certificates.floats.series import Series, exponential_terms

TERMS, MANY = 9, 60

FUNCTIONS: dict[str, Callable[[Any, Any], Any]] = {
    "sum": lambda a, b: a + b,
    "difference": lambda a, b: a - b,
    "from a number": lambda a, b: 1 - a + b * 0,
    "product": lambda a, b: a * b,
    "scaled": lambda a, b: a * arb("0.3") + b / 7,
    "times a float": lambda a, b: a * -3.7 + b * 0.3,
    "exp": lambda a, b: (a * b).exp(),
    "log": lambda a, b: (a * a + b * b + 1).log(),
    "cos": lambda a, b: a.cos() + b.cos(),
}
OF_NUMBERS: dict[str, Callable[[Any, Any], Any]] = {
    "quotient": lambda a, b: a / (b * b + 1),
    "square": lambda a, b: a**2 - b,
    "cosh": lambda a, b: (a * 0.1).cosh() * b,
    "extremes": lambda a, b: abs(a).max(b).min(arb(2)),
    "branches": lambda a, b: choose(a > b, a * 3, zero(a)) if not isinstance(a, arb) else a * 3 * int(bool(a > b)),
}


def drawn(seed: int, *shape: int) -> tuple[Balls, np.ndarray]:
    """Return balls of all sizes, and numbers inside them."""
    rng = np.random.default_rng(seed)
    mid = rng.normal(size=shape) * 10 ** rng.uniform(-3, 1.2, shape)
    rad = np.abs(mid) * 10 ** rng.uniform(-18, -1, shape) * rng.integers(0, 2, shape)
    return Balls(mid, rad), mid + rad * rng.uniform(-0.99, 0.99, shape)


def escapes(found: Balls, exact: list[arb]) -> bool:
    with ball_arithmetic():
        pairs = zip(
            found.mid.ravel().tolist(), np.broadcast_to(found.rad, found.mid.shape).ravel().tolist(), exact, strict=True
        )
        return any(np.isfinite(rad) and abs(number - arb(mid)) > arb(rad) for mid, rad, number in pairs)


def number_escapes(function: Callable[[Any, Any], Any], seed: int) -> bool:
    (a, x), (b, y) = drawn(seed, MANY), drawn(seed + 1000, MANY)
    with ball_arithmetic(), np.errstate(all="ignore"):
        exact = [function(arb(p), arb(q)) for p, q in zip(x.tolist(), y.tolist(), strict=True)]
        return escapes(function(a, b), exact)


def series_escapes(function: Callable[[Any, Any], Any], seed: int, degree: int) -> bool:
    (a, x), (b, y) = drawn(seed, degree, MANY), drawn(seed + 1000, degree, MANY)
    with ball_arithmetic(TERMS), np.errstate(all="ignore"):
        found = function(Series(a.mid, a.rad, TERMS), Series(b.mid, b.rad, TERMS))
        exact = [
            function(arb_series(p, prec=TERMS), arb_series(q, prec=TERMS))
            for p, q in zip(x.T.tolist(), y.T.tolist(), strict=True)
        ]
        return any(escapes(found[k], [series[k] for series in exact]) for k in range(TERMS))


def terms_escape(seed: int) -> bool:
    """Whether terms of e^x, of numbers in balls, lie outside of what encloses them."""
    ball, x = drawn(seed, MANY)
    found = exponential_terms(ball, TERMS)
    with ball_arithmetic():
        exact = [[arb(v) ** k / math.factorial(k) for v in x.tolist()] for k in range(TERMS)]
    return any(escapes(found.at(k), exact[k]) for k in range(TERMS))


def test_terms_of_exponentials_are_held(monkeypatch):
    assert not any(terms_escape(seed) for seed in range(5))
    monkeypatch.setattr(series, "U", 0.0)
    assert terms_escape(0)


@pytest.mark.parametrize("name", FUNCTIONS | OF_NUMBERS)
def test_balls_hold_the_numbers(name):
    assert not any(number_escapes((FUNCTIONS | OF_NUMBERS)[name], seed) for seed in range(5))


@pytest.mark.parametrize(
    ("name", "degree"), [(name, d) for name in FUNCTIONS for d in (2, 3) if (name, d) != ("cos", 3)]
)
def test_series_hold_the_coefficients(name, degree):
    assert not any(series_escapes(FUNCTIONS[name], seed, degree) for seed in range(3))


@pytest.mark.parametrize("name", ["product", "exp", "cos"])
def test_balls_without_rounding_hold_nothing(name, monkeypatch):
    for constant in ("U", "FUNCTION", "TINY"):
        monkeypatch.setattr(balls, constant, 0.0)
    monkeypatch.setattr(balls, "UP", 1.0)
    assert number_escapes(FUNCTIONS[name], 0)


def test_what_is_stored_holds_every_arb():
    with ball_arithmetic():
        for number in (arb(1) / 3, arb.pi() * 10**20, arb(2), arb("0.1 +/- 0.05"), arb(0)):
            found = Balls.of(number)
            assert not abs(number - arb(float(found.mid))) > arb(float(found.rad))
        assert Balls.of(arb(2)).rad == 0
        assert Balls.of(arb(0)).is_zero()
    assert Balls.of(arb.pos_inf()).highest == np.inf


def test_far_below_the_smallest_number_nothing_is_zero():
    """e^x is rounded to zero, and yet no ball around it leaves e^(x + d) out."""
    found = Balls(np.array([-760.0]), np.array([100.0])).exp()
    assert found.highest >= np.exp(-660.0)


def test_the_inverse_of_a_huge_ball_is_as_wide_as_the_ball():
    found = Balls(np.array([1e200]), np.array([5e199])).inverse()
    assert found.highest >= 1 / 5.1e199
    assert found.lowest <= 1 / 1.49e200


def test_sums_are_enlarged_by_more_than_they_lose():
    values = np.random.default_rng(0).uniform(0, 1, 10_000)
    with ball_arithmetic():
        assert arb(float(sums_up(np.sum(values), values.size))) >= sum((arb(v) for v in values.tolist()), arb(0))
