"""What is read out of printed curves, on curves where the answer is known."""

import numpy as np
import pytest

from pipeline.published.paper import period_of_curve, states_behind
from pipeline.published.scalar import growth_rates, scalar
from trackably.systems.intervals import Interval

TIMES = np.linspace(0, 4, 401)


@pytest.mark.parametrize("period", [2.95, 3.1251, np.pi])
def test_the_period_of_a_sum_of_harmonics(period):
    curve = np.sin(2 * np.pi / period * TIMES) + 0.3 * np.cos(6 * np.pi / period * TIMES + 1)
    curve[0] = np.nan
    found, left = period_of_curve(TIMES, curve, (2.9, 3.4), harmonics=5)
    assert found == pytest.approx(period, abs=1e-6)
    assert left < 1e-6


def test_growth_rates_tell_the_states_they_were_made_for():
    sets = {"state_set": Interval(-2, 2), "input_set": Interval(-3, 1.4)}
    plant = scalar(0.9, 0.1, 0.02, **sets, sampling_time=0.01)
    low, high = growth_rates(plant, Interval(-0.7, 1.1))
    lowest, highest = states_behind(plant, np.array([low]), np.array([high]))
    assert (lowest.item(), highest.item()) == pytest.approx((-0.7, 1.1), abs=1e-12)
