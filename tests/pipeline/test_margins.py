"""Finely sampled margins against a loop."""

import numpy as np
import pytest

from pipeline.margins import margin_profiles
from tests.trackably.gp.instances import over
from tests.trackably.systems.instances import PLANTS, SIGNAL
from trackably.systems.reference import Reference


@over({"state": 0, "input": 1}, "which")
@over(PLANTS, "plant")
def test_margin_profile_against_a_loop(plant, which):
    reference = Reference((SIGNAL,), plant)
    quantity = reference.quantities[which]
    profile = margin_profiles(reference, last_step=30, instants_per_step=7)[which]
    for k in range(31):
        inside = (k + np.arange(7) / 7) * plant.sampling_time
        margins = quantity.bounds.margin(quantity((SIGNAL,), inside))
        assert profile.at_steps[k] == pytest.approx(margins[0], abs=1e-12)
        assert profile.margins[k] == pytest.approx(min(margins), abs=1e-12)
        assert profile.times[k] == pytest.approx(inside[np.argmin(margins)], abs=1e-12)
    assert profile.worst == (np.min(profile.margins), profile.times[np.argmin(profile.margins)])
    assert profile.violated == [k for k in range(31) if profile.at_steps[k] < 0]


@pytest.mark.parametrize(("last", "together"), [(0, 1), (1000, 1), (1001, 2), (2001, 2), (5005, 6)])
def test_a_row_is_the_smallest_of_its_intervals(last: int, together: int) -> None:
    reference = Reference((SIGNAL,), next(iter(PLANTS.values())))
    profile, T = margin_profiles(reference, last, 3)[0], reference.plant.sampling_time
    first = np.arange(0, last + 1, together)
    margins = profile.quantity.margin(reference.signals, reference.instants(np.arange(3 * (last + 1)) / 3))
    np.testing.assert_array_equal(profile.starts, T * first)
    np.testing.assert_allclose(profile.margins, np.minimum.reduceat(margins, 3 * first), atol=1e-12)
    np.testing.assert_allclose(profile.at_steps, np.minimum.reduceat(margins[::3], first), atol=1e-12)
    assert np.all((profile.starts <= profile.times) & (profile.times < profile.starts + together * T))
