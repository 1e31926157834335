"""Hyperparameters that end where their search did are pointed out."""

import warnings

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES
from trackably import DoubtfulInputWarning, SquaredExponential, TrackableReference, learn_reference
from trackably.fit import Edge
from trackably.gp.hyperparameter import Learned
from trackably.systems.polytopes import Interval

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


def test_an_interval_with_room_is_not() -> None:
    found = learned(SquaredExponential(0.5, (0.1, 4.0)), noise_std=(0.001, 0.2))
    assert found.fit.edges == ()
    assert "interval in which it was sought" not in found.explanation


def test_intervals_that_were_chosen_are_pointed_out_without_a_warning() -> None:
    edge = Edge.of("noise_std", Learned(1e-4), Interval(1e-4, 10.0))
    assert edge is not None
    assert not edge.is_given
    assert str(edge).startswith("noise_std = 0.0001 lies at the lower end")


@pytest.mark.parametrize("interval", [Interval(1e-3, 1e3), Interval(1e-12, 1e-9), Interval(1.0, 1.5)])
def test_only_ends_are_edges(interval: Interval) -> None:
    for part in np.linspace(0.01, 0.99, 9):
        value = interval.lower ** (1 - part) * interval.upper**part
        assert Edge.of("θ", Learned(value), interval) is None
    for value in (interval.lower, interval.upper, interval.lower * (1 + 1e-9), interval.upper * (1 - 1e-9)):
        assert Edge.of("θ", Learned(value, (interval.lower, interval.upper)), interval) is not None


def test_what_is_known_has_no_edge() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert learned(SquaredExponential(0.5, 0.9)).fit.edges == ()
