"""A long stream in one call: one reference, one certificate that the checker proves, and what is said of it."""

from functools import partial

import numpy as np
import pytest

from tests.trackably.plants import AXIS
from trackably import (
    ConstrainedSystem,
    IgnoresSamplesWarning,
    Polytope,
    Samples,
    SquaredExponential,
    StreamReference,
    learn_stream,
)

TIMES = np.arange(1800) / 60
MOVED = -0.45 + 0.4 * np.sin(1.3 * TIMES + np.sin(0.4 * TIMES))
SAMPLES = {"position": Samples(TIMES, MOVED + 0.05 * np.random.default_rng(4).standard_normal(TIMES.size))}
learn = partial(
    learn_stream,
    SAMPLES,
    plant=AXIS,
    kernel=SquaredExponential(),
    claim=(0.0, 29.0),
    window=10.0,
    noise_std=(0.01, 0.5),
    mean=-0.45,
    starts=2,
)


@pytest.fixture(scope="module")
def learned() -> StreamReference:
    return learn()


def test_the_reference_follows_the_samples_within_their_noise(learned):
    off = SAMPLES["position"].values - learned.reference.state_at(TIMES)[:, 0]
    assert learned.misfit["position"] == pytest.approx(float(np.sqrt(np.mean(off**2))), rel=1e-3)
    assert learned.misfit["position"] == pytest.approx(0.05, rel=0.05)
    assert learned.hyperparameters["noise_std"] == pytest.approx(0.05, rel=0.1)


def test_a_reference_that_bounds_keep_from_its_samples_is_announced():
    low = ConstrainedSystem(AXIS.system, Polytope.box([-0.5, -1.0], [-0.4, 1.0]), AXIS.input_set)
    few = Samples(TIMES[:600:6], SAMPLES["position"].values[:600:6])
    with pytest.warns(IgnoresSamplesWarning, match=r"it is 0\.\d+ off those of position; wider bounds may help"):
        learn_stream(few, low, SquaredExponential(0.4, 1.0), "all_times", window=5.0, noise_std=0.05, mean=-0.45)


@pytest.mark.parametrize("window", [0.1, 0.02])
def test_a_window_of_a_few_samples_is_refused(window):
    with pytest.raises(ValueError, match=rf"^window: .* and 8 samples, got {window} s .* every 0\.0167 s, 1800 in"):
        learn(window=window)
