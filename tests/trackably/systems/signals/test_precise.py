"""Values of polynomial pieces are those of rational numbers, at breakpoints and where terms cancel."""

from fractions import Fraction

import numpy as np
import pytest

from tests.splines.draws import drawn
from tests.splines.naive import quantity_at, value_of
from trackably.systems.pieces import PolynomialPieces

UNIT = Fraction(1, 2**53)


def near(ends):
    """Times at, just before and just after each end."""
    return np.concatenate([ends, np.nextafter(ends, -np.inf), np.nextafter(ends, np.inf)])


COEFFICIENTS = [[1.0, 2.0], [-7.0, 0.1], [1e6, -3.0], [0.25, 0.5]]


@pytest.mark.parametrize("beyond", ["rest", "period", "end"])
@pytest.mark.parametrize("turns", [0, 1, -3, 10**6])
def test_pieces_begin_exactly_at_their_breakpoints(beyond, turns):
    first = 0.0 if beyond == "period" else 0.05  # a period is exact; the time since a breakpoint is rounded otherwise
    signal = PolynomialPieces([first, 0.3, 0.7, 1.1, 1.5], COEFFICIENTS, beyond)
    whole = [t + turns * signal.period for t in signal.breakpoints] if beyond == "period" else signal.breakpoints
    times = np.concatenate([near(np.array(whole)), np.array(whole) + 0.123])  # between them, and beyond the last
    found = signal.precise([times])
    for t, *value in zip(times.tolist(), found.high.tolist(), found.low.tolist(), strict=True):
        exact = value_of(signal, Fraction(t))
        assert float(signal(t)) == value[0] == pytest.approx(float(exact), rel=1e-15, abs=1e-29)
        assert abs(sum(map(Fraction, value)) - exact) <= 200 * UNIT**2 * 10**6


@pytest.mark.parametrize("number", range(10))
def test_states_and_inputs_are_rounded_once(number):
    found = drawn(3, number)
    reference, rng = found.reference, np.random.default_rng(number)
    last = max(float(z.breakpoints[-1]) for z in reference.pieces)
    times = rng.uniform(*(found.window or (0.0, last)), 7)
    values = np.concatenate([reference.state_at(times), reference.input_at(times)], axis=-1)
    for i, of in enumerate((*reference.plant.flatness.states, *reference.plant.flatness.inputs)):
        for t, value in zip(times.tolist(), values[:, i].tolist(), strict=True):
            expected = quantity_at(of.functional, reference.pieces, Fraction(t))
            assert abs(Fraction(value) - expected) <= 1.001 * UNIT * abs(expected) + Fraction(1, 10**24)
