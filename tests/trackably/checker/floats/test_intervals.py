"""Arrays of float64 intervals contain what they stand for, compared with rational numbers and with many digits."""

from collections.abc import Callable
from fractions import Fraction
from operator import mul

import numpy as np
import pytest
from mpmath import mp

from trackably.checker import intervals as single
from trackably.checker.floats import boxes, intervals
from trackably.checker.floats.boxes import nowhere_negative
from trackably.checker.floats.intervals import Floats, bernstein_of, sums

COUNT = 400
OPERATIONS = {
    "+": lambda x, y: x + y,
    "-": lambda x, y: x - y,
    "*": lambda x, y: x * y,
    "/": lambda x, y: x / y,
    "abs": lambda x, _: abs(x),
    "square": lambda x, _: x**2,
    "power": lambda x, _: x**5,
    "number - x": lambda x, _: 1 - x,
    "number / x": lambda x, _: 3 / x,
}
FUNCTIONS = ("exp", "log", "cos", "sin")
COMPARED = {
    **{name: (formed, formed) for name, formed in OPERATIONS.items()},
    **{
        name: (lambda x, _, name=name: getattr(x, name)(), lambda x, _, name=name: getattr(mp, name)(x))
        for name in FUNCTIONS
    },
}


def numbers(rng: np.random.Generator, low: float = -5, high: float = 5) -> np.ndarray:
    return rng.choice([-1, 1], COUNT) * 10 ** rng.uniform(low, high, COUNT)


def drawn(rng: np.random.Generator, name: str) -> Floats:
    """Points, narrow and wide intervals, of any sign."""
    if name in OPERATIONS:
        low = numbers(rng)
        return Floats(low, low + np.abs(low) * rng.choice([0.0, 1e-16, 1e-3, 3.0], COUNT))
    low = numbers(rng, -8, 2.5)
    low = np.abs(low) if name == "log" else low
    return Floats(low, low + rng.choice([0.0, 1e-9, 0.1, 2.0], COUNT))


def inside(x: Floats, rng: np.random.Generator) -> list[float]:
    part = rng.choice([0.0, 1.0, 0.5], COUNT)
    return np.clip(x.low + part * (x.high - x.low), x.low, x.high).tolist()


def escapes(name: str, evaluated: Callable | None = None) -> int:
    """How many values lie outside of what is found; a NaN of a function holds none."""
    rng, (formed, true), count = np.random.default_rng(0), COMPARED[name], 0
    x, y = drawn(rng, name), drawn(rng, name)
    with mp.workprec(3 * single.iv.prec):
        found = (evaluated or formed)(x, y)
        for a, b, low, high in zip(inside(x, rng), inside(y, rng), found.low, found.high, strict=True):
            value = true(mp.mpf(a), mp.mpf(b))
            is_unknown = name not in FUNCTIONS and np.isnan(low)  # a divisor that may be zero
            count += not (is_unknown or low <= value <= high)
    return count


@pytest.mark.parametrize("name", COMPARED)
def test_every_value_is_held(name):
    assert escapes(name) == 0
    if name in FUNCTIONS:
        assert escapes(name, lambda x, _: in_mpmath(name, x)) == 0
    else:
        found = OPERATIONS[name](Floats.exact(numbers(np.random.default_rng(1))), Floats.exact(3.0))
        assert np.all(found.high - found.low <= 1e-14 * np.abs(found.high))


def in_mpmath(name: str, x: Floats) -> Floats:
    """The same function of each interval for itself, in mpmath."""
    found = [getattr(single, name)(single.between(*ends)) for ends in zip(x.low.tolist(), x.high.tolist(), strict=True)]
    return Floats(*(np.array([mp.mpf(end._mpi_[k]) for end in found]) for k in (0, 1)))


def test_cosines_of_intervals_hold_their_extremes():
    rng = np.random.default_rng(0)
    near = np.pi * np.arange(-300, 300) + rng.uniform(-1e-9, 1e-9, 600)
    x = Floats(near - rng.uniform(1e-8, 7, 600), near + rng.uniform(1e-8, 7, 600))
    extremes = (-1.0) ** np.arange(-300, 300)
    for found in (x.cos(), in_mpmath("cos", x)):
        assert np.all((found.low <= extremes) & (extremes <= found.high))


def test_sums_of_runs_hold_the_true_sums():
    rng = np.random.default_rng(0)
    values, firsts = 10 ** rng.uniform(-8, 8, 3000) * rng.choice([-1, 1], 3000), np.array([0, 1, 40, 2000])
    found = sums(Floats.exact(values), firsts)
    for run, low, high in zip(np.split(values, firsts[1:]), found.low, found.high, strict=True):
        true = sum(map(Fraction, run.tolist()))
        assert low <= true <= high
        assert high - low <= 1e-11 * np.sum(np.abs(run))


def test_what_is_not_known_is_never_certain():
    with np.errstate(all="ignore"):
        unknown = Floats.exact(np.array([np.nan, 1.0])) * Floats(np.array([1.0, -np.inf]), np.array([1.0, np.inf]))
        overflown = Floats.exact(np.array([1e300])) * Floats.exact(1e300)
        for x in (unknown, Floats.exact(-1.0).log(), 1 / Floats(np.array([-1.0]), np.array([1.0]))):
            assert not np.any((x > -np.inf) & (x < np.inf))
            assert not np.any((x * 0.0 > -np.inf) & (x * 0.0 < np.inf))
    assert not overflown > 1e308
    assert not np.any(nowhere_negative(Floats.exact(np.full((4, 3), np.nan))))


def extreme(rng: np.random.Generator, shape: tuple[int, int]) -> Floats:
    """Numbers, narrow and wide intervals whose sizes are all those of float64, also numbers that are subnormal."""
    low = np.ldexp(rng.uniform(1, 2, shape) * rng.choice([-1, 1], shape), rng.integers(-1074, 1024, shape))
    width = np.abs(low) * rng.choice([0.0, 2.0**-52, 2.0**-20], shape)
    return Floats.exact(low) if rng.integers(2) else Floats(low, np.where(np.isfinite(low + width), low + width, low))


def is_inside(number: Fraction, low: float, high: float) -> bool:
    """An end that is NaN bounds nothing, and neither does one at infinity on the side where nothing is beyond it."""
    above = np.isnan(low) or low == -np.inf or (low < np.inf and Fraction(low) <= number)
    return bool(above and (np.isnan(high) or high == np.inf or (high > -np.inf and number <= Fraction(high))))


@pytest.mark.parametrize("seed", range(8))
def test_sums_of_products_of_any_sizes_are_contained(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    for count in (1, 2, 3, 16, 17):
        x, y = extreme(rng, (count, 60)), extreme(rng, (count, 60))
        with np.errstate(all="ignore"):
            found = Floats.dot([x.at(k) for k in range(count)], [y.at(k) for k in range(count)])
            monkeypatch.setattr(intervals, "bernstein", lambda *_, row=x.low[:, :1].T: row)
            row = bernstein_of(y)
        for j in range(60):
            for ends in (("low", "low"), ("low", "high"), ("high", "high")):
                a, b = (map(Fraction, getattr(of, end)[:, j].tolist()) for of, end in zip((x, y), ends, strict=True))
                assert is_inside(sum(map(mul, a, b)), found.low[j], found.high[j])
            for end in (y.low, y.high):
                true = sum(map(mul, map(Fraction, x.low[:, 0].tolist()), map(Fraction, end[:, j].tolist())))
                assert is_inside(true, row.low[0, j], row.high[0, j])


def kept_below(above: float) -> float:
    """The part of polynomials, all with the minimum `above`, that are shown to be nowhere negative.

    Powers fall as in a box of a cover.
    """
    rng, x = np.random.default_rng(0), np.linspace(-1, 1, 5_001)
    moved = rng.normal(size=(12, 200)) * 0.3 ** np.arange(12)[:, None]
    moved[0] += above - np.min(np.polynomial.polynomial.polyval(x, moved), axis=1)
    return float(np.mean(nowhere_negative(Floats.exact(moved))))


def test_positive_polynomials_are_found_and_none_that_is_negative_by_a_hair():
    assert kept_below(-1e-9) == 0
    assert kept_below(1e-6) == 1


FAULTS = {
    "values at ends decide": ("is_never_negative", lambda _: lambda _: True),
    "coefficients off by a millionth": ("bernstein_of", lambda right: lambda of: right(of) + Floats.exact(1e-6)),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_believe_polynomials_that_are_negative_somewhere(fault, monkeypatch):
    name, wrong = FAULTS[fault]
    monkeypatch.setattr(boxes, name, wrong(getattr(boxes, name)))
    assert kept_below(-1e-9) > 0


def test_a_lost_outward_rounding_is_seen(monkeypatch):
    monkeypatch.setattr(intervals, "_outwards", lambda low, high, *_, **__: Floats(low, high))
    for name in ("+", "-", "*", "/", "square", "power"):
        assert escapes(name) > COUNT / 20, name
    assert sum(map(escapes, FUNCTIONS)) > COUNT / 20
