"""References of fewer centres than samples: what they cost is said and true, and the proof is that of any reference."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.trackably.plants import AXIS
from tests.trackably.saved import assert_comes_back
from trackably import Samples, SquaredExponential, TrackableReference, learn_reference
from trackably.gp.joint import JointPosterior

RANDOM = np.random.default_rng(3)
TIMES = np.cumsum(RANDOM.uniform(0.001, 0.01, 500))
MOVED = -0.45 - 0.62 * np.cos(1.55 * TIMES)
NOISE = 0.05
DENSE = Samples(TIMES, MOVED + NOISE * RANDOM.standard_normal(TIMES.size))
VELOCITIES = Samples(TIMES, 0.961 * np.sin(1.55 * TIMES) + 0.2 * RANDOM.standard_normal(TIMES.size))
CENTRES = 48
learned = partial(
    learn_reference, plant=AXIS, kernel=SquaredExponential(), claim=(0.0, 2.7), noise_std=(0.01, 0.3), starts=2
)


@pytest.fixture(scope="module")
def fewer() -> TrackableReference:
    return learned({"position": DENSE}, centres=CENTRES)


def test_the_misfit_is_that_of_all_samples(fewer):
    off = DENSE.values - fewer.reference.state_at(DENSE.times)[:, 0]
    assert fewer.misfit["position"] == pytest.approx(float(np.sqrt(np.mean(off**2))), rel=1e-4)


def test_the_stated_cost_is_the_change_of_l_with_all_samples(fewer):
    (cost,) = fewer.fit.condensed
    all_of_them = JointPosterior(fewer.prior, (replace(DENSE, stencil=fewer.samples[0].stencil),))
    nlml = JointPosterior(fewer.prior, fewer.samples).negative_log_marginal_likelihood()[0]
    assert cost.change_of_l == pytest.approx(all_of_them.negative_log_marginal_likelihood()[0] - nlml, abs=1e-6)
    assert "of 500 samples of position by 48 centres: with all, −2 ln p changes by" in fewer.explanation


def test_saved_centres_still_represent_all_samples(fewer, tmp_path):
    assert_comes_back(fewer, tmp_path)


def test_positions_and_velocities_are_condensed_by_name():
    found = learned(
        {"position": DENSE, "velocity": VELOCITIES}, noise_std={"position": 0.05, "velocity": 0.2}, centres=24
    )
    counts = {name: (len(samples), samples.scatter.count) for name, samples in found.sampled.items()}
    assert counts == dict.fromkeys(("position", "velocity"), (24, 476))
    (cost,) = found.fit.condensed
    assert cost.apart < 0.1
