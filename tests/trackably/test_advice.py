"""Messages advise what can help whoever reads them, and have no numbers of rounding's size."""

import pytest

from tests.trackably.plants import SAMPLES
from trackably import (
    ConstrainedSystem,
    LinearSystem,
    Polytope,
    SquaredExponential,
    learn_reference,
)
from trackably.systems.intervals import Interval

ROOM = 20.3
HEATED = ConstrainedSystem(
    LinearSystem([[0.9]], [[0.1]], [0.1 * ROOM], states=("temperature",), inputs=("heating",), sampling_time=0.1),
    Polytope.box([10.0], [30.0]),
    Polytope.box([0.0], [5.0]),
)


def test_rounding_of_zero_is_said_to_be_zero():
    """No heating keeps the room's temperature: rounding makes it a number near 1e-16."""
    level = HEATED.quantities[-1].at_rest([ROOM])
    assert 0 < abs(level) < 1e-12
    with pytest.raises(ValueError, match=r"the heating is 0, on a bound of \[0, 5\]"):
        learn_reference(SAMPLES, HEATED, SquaredExponential(1.0, 1.0), "all_times", noise_std=0.05, mean=ROOM)


@pytest.mark.parametrize(
    ("value", "kept"), [(-1.5e-17, 0.0), (1e-13, 0.0), (1.0 + 1e-16, 1.0), (1e-9, 1e-9), (-0.1, -0.1)]
)
def test_only_rounding_is_snapped(value, kept):
    assert Interval(0.0, 1.0).snapped(value) == kept
