"""Hyperparameters that end where their search did are pointed out."""

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES
from trackably import DoubtfulInputWarning, SquaredExponential, TrackableReference, learn_reference
from trackably.fit import Edge
from trackably.gp.hyperparameter import Learned
from trackably.systems.intervals import Interval

WINDOW = (0.0, 3.0)


def learned(kernel: SquaredExponential, noise_std: float | tuple[float, float] | None = 0.02) -> TrackableReference:
    return learn_reference(SAMPLES, AXIS, kernel, WINDOW, noise_std=noise_std, starts=2)


def test_an_interval_that_holds_back_is_asked_about() -> None:
    """The likelihood wants a length scale near 0.9 s."""
    with pytest.warns(DoubtfulInputWarning, match=r"^lengthscale = 0\.5 lies at the upper .*, \[0\.1, 0\.5\]: was it"):
        short = learned(SquaredExponential(0.5, (0.1, 0.5)))
    with pytest.warns(
        DoubtfulInputWarning, match=r"^lengthscale = 1\.5 lies at the lower end of the interval in which"
    ):
        long = learned(SquaredExponential(0.5, (1.5, 4.0)))
    for found, end in ((short, "upper"), (long, "lower")):
        assert found.explanation.endswith(f"lies at the {end} end of the interval in which it was sought")


@pytest.mark.parametrize("interval", [Interval(1e-3, 1e3), Interval(1e-12, 1e-9), Interval(1.0, 1.5)])
def test_only_ends_are_edges(interval: Interval) -> None:
    for part in np.linspace(0.01, 0.99, 9):
        value = interval.lower ** (1 - part) * interval.upper**part
        assert Edge.of("θ", Learned(value), interval) is None
    for value in (interval.lower, interval.upper, interval.lower * (1 + 1e-9), interval.upper * (1 - 1e-9)):
        assert Edge.of("θ", Learned(value, (interval.lower, interval.upper)), interval) is not None
