"""A mean that is learned at an end of its interval is asked about; hyperparameters may have samples of their own."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES, TIMES
from trackably import DoubtfulInputWarning, Polytope, Samples, SquaredExponential, TrackableReference, learn_reference
from trackably.gp.joint import JointPrior
from trackably.gp.prior import Prior
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace

SHIFTED = Samples(TIMES, SAMPLES.values - 0.4)
WIDE = replace(AXIS, state_set=Polytope.box([-2.0, -1.2], [0.5, 1.2]))


def learned(**options) -> TrackableReference:
    given = {"kernel": SquaredExponential(), "claim": "all_times", "noise_std": 0.02, "starts": 2} | options
    return learn_reference({"position": SHIFTED}, WIDE, **given)


def test_an_interval_that_holds_the_mean_back_is_asked_about() -> None:
    with pytest.warns(DoubtfulInputWarning, match="mean: the learned mean of position lies at an end of the interval"):
        found = learned(mean=(-0.1, 0.3))
    assert found.prior.parts[0].mean == pytest.approx(-0.1)


def test_hyperparameters_from_samples_of_their_own() -> None:
    """The paper's D_θ and D_t."""
    times = np.linspace(0, 6, 40)
    other = Samples(times, 0.3 * np.sin(4 * times) + 0.03 * np.random.default_rng(3).standard_normal(40))
    noise = (0.001, 0.2)
    found = learned(learn_from={"position": other}, noise_std=noise)
    prior = JointPrior((Prior(SquaredExponential(), noise),))
    least = best_solution(ConstrainedProblem((other,), prior, SearchSpace.around((other,), prior, 2)))
    assert isinstance(least, Solution)
    known = least.posterior.prior.hyperparameters
    for name in ("lengthscale", "signal_std"):  # position is not quite the flat output
        assert found.hyperparameters[name] == pytest.approx(known[name], rel=0.02)
    assert found.prior.learned == ()
    assert found.samples[0].values.tolist() == SHIFTED.values.tolist()
