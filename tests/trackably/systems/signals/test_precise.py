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


STEPS = {"breakpoints": [0.0, 0.3, 0.7, 1.1, 1.5], "coefficients": [[1.0, 2.0], [-7.0, 0.1], [1e6, -3.0], [0.25, 0.5]]}


@pytest.mark.parametrize("beyond", ["rest", "period", "end"])
@pytest.mark.parametrize("turns", [0, 1, -3, 10**6])
def test_pieces_begin_exactly_at_their_breakpoints(beyond, turns):
    signal = PolynomialPieces(**STEPS, beyond=beyond)
    whole = [t + turns * signal.period for t in signal.breakpoints] if beyond == "period" else signal.breakpoints
    times = near(np.array(whole))
    for t, value in zip(times.tolist(), signal(times).tolist(), strict=True):
        assert value == pytest.approx(float(value_of(signal, Fraction(t))), rel=1e-15, abs=1e-29)


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
