"""Finely sampled margins against a loop, and Definition 1 against its algebraic equivalent."""

import numpy as np
import pytest

from pipeline.margins import margin_profiles, smallest_defect
from pipeline.published.scalar import coefficients, interval_sets
from tests.trackably.gp.instances import over
from tests.trackably.systems.instances import PLANTS, SIGNAL, bounded
from trackably.systems.intervals import Interval
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
    assert profile.violated_steps == [k for k in range(31) if profile.at_steps[k] < 0]


@over(PLANTS, "plant")
def test_smallest_defect_is_what_the_input_bound_is_broken_by(plant):
    """|b| times the worst violation of U, or zero: no other input does better."""
    for input_set in (interval_sets(plant)[1], Interval(-10.0, 10.0)):
        reference = Reference((SIGNAL,), bounded(plant, input_set=input_set))
        margins = input_set.margin(reference.input(np.arange(41)))
        expected = abs(coefficients(plant)[1]) * max(0.0, -float(np.min(margins)))
        assert smallest_defect(reference, 40) == pytest.approx(expected, abs=1e-6)
