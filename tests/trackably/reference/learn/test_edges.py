"""Hyperparameters that end where their search did are pointed out."""

from functools import partial

import pytest

from tests.trackably.plants import AXIS, SAMPLES
from trackably import DoubtfulInputWarning, SquaredExponential, learn_reference


def test_an_interval_that_holds_back_is_asked_about() -> None:
    """The likelihood wants a length scale near 0.9 s."""
    learned = partial(learn_reference, SAMPLES, AXIS, claim=(0.0, 3.0), noise_std=0.02, starts=2)
    with pytest.warns(DoubtfulInputWarning, match=r"^lengthscale = 0\.5 lies at the upper .*, \[0\.1, 0\.5\]: was it"):
        short = learned(kernel=SquaredExponential(0.5, (0.1, 0.5)))
    with pytest.warns(
        DoubtfulInputWarning, match=r"^lengthscale = 1\.5 lies at the lower end of the interval in which"
    ):
        long = learned(kernel=SquaredExponential(0.5, (1.5, 4.0)))
    for found, end in ((short, "upper"), (long, "lower")):
        assert found.explanation.endswith(f"lies at the {end} end of the interval in which it was sought")
