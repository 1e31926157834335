"""Polynomial pieces in twice the precision are those of rational numbers, at breakpoints and where terms cancel."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.splines.draws import drawn
from tests.splines.naive import quantity_at, value_of
from tests.trackably.plants import AXIS
from trackably.systems.pieces import DoubleDouble, ExactSum, PolynomialPieces, two_product, two_sum
from trackably.systems.reference import Reference

UNIT = Fraction(1, 2**53)
NUMBERS = st.floats(-1e12, 1e12).filter(lambda x: x == 0 or abs(x) > 1e-60)


def exact(number: DoubleDouble) -> Fraction:
    return Fraction(float(number.high)) + Fraction(float(number.low))


@given(NUMBERS, NUMBERS)
def test_sums_and_products_of_two_numbers_lose_nothing(a, b):
    x, y = np.asarray(a), np.asarray(b)
    for found, expected in ((two_sum(x, y), Fraction(a) + Fraction(b)), (two_product(x, y), Fraction(a) * Fraction(b))):
        assert Fraction(float(found[0])) + Fraction(float(found[1])) == expected
        assert float(found[0]) == float(expected)


@given(st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS))
def test_arithmetic_in_twice_the_precision(numbers):
    a, b, c, d = (np.asarray(number) for number in numbers)
    x, y = DoubleDouble(*two_sum(a, b * 1e-15)), DoubleDouble(*two_sum(c, d * 1e-15))
    p, q = exact(x), exact(y)
    assert abs(exact(x + y) - (p + q)) <= 8 * UNIT**2 * (abs(p) + abs(q))
    assert abs(exact(x * y) - p * q) <= 8 * UNIT**2 * abs(p * q)
    for number in (x + y, x * y):
        assert number.high + number.low == number.high


@given(st.lists(NUMBERS, min_size=1, max_size=7))
def test_exact_sums_are_exact(terms):
    found, expected = ExactSum.of(map(np.asarray, terms)), sum(map(Fraction, terms), Fraction(0))
    assert sum((Fraction(float(part)) for part in found.parts), Fraction(0)) == expected
    assert abs(Fraction(float(found.rounded)) - expected) <= 8 * UNIT * abs(expected)
    assert abs(exact(found.double_double) - expected) <= 80 * UNIT**2 * abs(expected)


def near(ends):
    """Times at, just before and just after each end."""
    return np.concatenate([ends, np.nextafter(ends, -np.inf), np.nextafter(ends, np.inf)])


STEPS = {"breakpoints": [0.0, 0.3, 0.7, 1.1, 1.5], "coefficients": [[1.0, 2.0], [-7.0, 0.1], [1e6, -3.0], [0.25, 0.5]]}


@pytest.mark.parametrize("beyond", ["rest", "period", "end"])
@pytest.mark.parametrize("turns", [0, 1, -3, 10**6])
def test_pieces_begin_exactly_at_their_breakpoints(beyond, turns):
    signal = PolynomialPieces(**STEPS, beyond=beyond)
    whole = [t + turns * signal.period for t in signal.breakpoints] if beyond == "period" else signal.breakpoints
    times = near(np.array(whole))
    for t, value in zip(times.tolist(), signal.summed(times).tolist(), strict=True):
        assert value == pytest.approx(float(value_of(signal, Fraction(t))), rel=1e-15, abs=1e-29)


def test_a_sum_of_times_is_not_rounded():
    signal = PolynomialPieces([0.0, 1.0, 2.0], [[0.0], [1.0]])
    assert 1.0 - 1e-30 == 1.0
    below, above = ([np.asarray(1.0), np.asarray(by)] for by in (-1e-30, 1e-30))
    assert (float(signal.precise(below).high), float(signal.precise(above).high)) == (0.0, 1.0)


def test_steps_of_a_reference_are_exact_multiples_of_the_sampling_time():
    k = np.arange(400)
    late = k[
        [Fraction(float(t)) > n * Fraction(AXIS.sampling_time) for t, n in zip(k * AXIS.sampling_time, k, strict=True)]
    ]
    jump = float(late[0] * AXIS.sampling_time)
    reference = Reference((PolynomialPieces([0.0, jump, 40.0], [[0.0], [1.0]]),), AXIS)
    assert reference.state_at(np.asarray(jump))[0] == pytest.approx(1.0, abs=0.6)
    exactly = quantity_at(AXIS.flatness.states[0], reference.pieces, int(late[0]) * Fraction(AXIS.sampling_time))
    assert reference.state(int(late[0]))[0] == pytest.approx(float(exactly), rel=1e-15)


@pytest.mark.parametrize("number", range(28))
def test_states_and_inputs_are_rounded_once(number):
    found = drawn(3, number)
    reference, rng = found.reference, np.random.default_rng(number)
    last = max(float(z.breakpoints[-1]) for z in reference.pieces)
    times = rng.uniform(*(found.window or (0.0, last)), 7)
    values = np.concatenate([reference.state_at(times), reference.input_at(times)], axis=-1)
    for i, functional in enumerate((*reference.plant.flatness.states, *reference.plant.flatness.inputs)):
        for t, value in zip(times.tolist(), values[:, i].tolist(), strict=True):
            expected = quantity_at(functional, reference.pieces, Fraction(t))
            assert abs(Fraction(value) - expected) <= 1.001 * UNIT * abs(expected) + Fraction(1, 10**24)
