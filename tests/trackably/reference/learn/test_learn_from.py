"""A mean that is learned at an end of its interval is asked about; hyperparameters may have samples of their own."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES, TIMES
from trackably import DoubtfulInputWarning, Polytope, Samples, SquaredExponential, TrackableReference, learn_reference

SHIFTED = Samples(TIMES, SAMPLES.values - 0.4)
WIDE = replace(AXIS, state_set=Polytope.box([-2.0, -1.2], [0.5, 1.2]))


def learned(samples=SHIFTED, plant=WIDE, **options) -> TrackableReference:
    given = {"kernel": SquaredExponential(), "claim": "all_times", "noise_std": 0.02, "starts": 2} | options
    return learn_reference({"position": samples}, plant, **given)


def test_an_interval_that_holds_the_mean_back_is_asked_about() -> None:
    with pytest.warns(
        DoubtfulInputWarning, match="mean: the learned mean of position lies at an end of its given interval"
    ):
        found = learned(mean=(-0.1, 0.3))
    assert found.prior.parts[0].mean == pytest.approx(-0.1)


def test_hyperparameters_from_samples_of_their_own() -> None:
    """The paper's D_θ and D_t."""
    times = np.linspace(0, 6, 40)
    other = Samples(times, 0.3 * np.sin(4 * times) + 0.03 * np.random.default_rng(3).standard_normal(40))
    free = replace(AXIS, state_set=Polytope.box([-9, -9], [9, 9]), input_set=Polytope.box([-99], [99]))
    found = learned(learn_from={"position": other}, noise_std=(0.001, 0.2))
    alone = learned(other, free, noise_std=(0.001, 0.2))
    assert found.hyperparameters == pytest.approx(alone.hyperparameters, rel=0.02)
    assert found.prior.learned == ()
    assert found.samples[0].values.tolist() == SHIFTED.values.tolist()
