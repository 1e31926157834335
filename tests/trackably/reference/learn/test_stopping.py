"""A robot that stops: its heading turns at once where it stands, so that formulas bend sharply beside a bound."""

import numpy as np
import pytest

from trackably import ConstrainedSystem, Polytope, Samples, SquaredExponential, learn_reference, mobile_robot
from trackably.reference.trackable import TrackableReference

TIMES = np.arange(0.0, 5.01, 0.5)
pytestmark = pytest.mark.filterwarnings("ignore::trackably.IgnoresSamplesWarning")


def stopping(slowest: float) -> TrackableReference:
    """Two metres along a corridor, the first and the last half second of which the samples stand still."""
    noise = 0.02 * np.random.default_rng(0).standard_normal((2, TIMES.size))
    part = np.clip((TIMES - 0.5) / 4.0, 0.0, 1.0)
    x = 2.0 * (10 * part**3 - 15 * part**4 + 6 * part**5)
    samples = {"x": Samples(TIMES, x + noise[0]), "y": Samples(TIMES, 0.3 * np.sin(2.5 * x) + noise[1])}
    inside = Polytope.box([-1.0, -0.25, -np.inf], [3.0, 0.25, np.inf])
    driven = ConstrainedSystem(mobile_robot(0.1), inside, Polytope.box([slowest, -1.5], [0.8, 1.5]))
    known = {"noise_std": 0.02, "mean": {"x": 1.0, "y": 0.0}, "starts": 1}
    return learn_reference(samples, driven, SquaredExponential(0.7, 1.2), (0.0, 5.0), **known)


def test_a_looser_lower_bound_of_the_speed_costs_no_more_and_a_tightened_one_is_told() -> None:
    standing, moving = stopping(0.0), stopping(0.05)
    assert moving.fit.method == standing.fit.method == "joint"
    assert standing.objective <= moving.objective + moving.fit.solution.allowed_gap
    assert moving.misfit["x"] <= 1.1 * standing.misfit["x"] + 0.01
    # A speed of zero has no slope at a stop: the search stays away from it, and says so.
    said = "the search tightened some bounds by up to 0.05 times their width"
    assert said in standing.explanation
    assert "the search tightened" not in moving.explanation
