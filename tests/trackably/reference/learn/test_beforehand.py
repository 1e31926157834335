"""Prior means are learned as they are most likely; hyperparameters may be learned from samples of their own."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES, TIMES
from trackably import DoubtfulInputWarning, Polytope, Samples, SquaredExponential, TrackableReference, learn_reference
from trackably.gp.joint import JointPrior
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.stencil import Stencil
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace

SHIFTED = Samples(TIMES, SAMPLES.values - 0.4)


def test_changes_alone_say_nothing_of_the_mean() -> None:
    samples = Samples(TIMES, SHIFTED.values, np.ones(16), Stencil((0.0,) * 2 + (1.0,)))
    assert Posterior(Prior(SquaredExponential(1, 1), 0.1), samples).with_likeliest_mean(-9, 9).prior.mean != 0
    none = Samples(TIMES, SHIFTED.values, np.ones(16), Stencil((-1.0, 1.0), 0.1))
    assert Posterior(Prior(SquaredExponential(1, 1), 0.1, 0.5), none).with_likeliest_mean(-9, 9).prior.mean == 0.5


def learned(samples: Samples = SHIFTED, **options) -> TrackableReference:
    given = {"kernel": SquaredExponential(), "claim": "all_times", "noise_std": 0.02, "starts": 2} | options
    return learn_reference({"position": samples}, WIDE, **given)


WIDE = replace(AXIS, state_set=Polytope.box([-2.0, -1.2], [0.5, 1.2]))


def test_an_interval_that_holds_the_mean_back_is_asked_about() -> None:
    with pytest.warns(DoubtfulInputWarning, match="mean: the learned mean of position lies at an end of the interval"):
        found = learned(mean=(-0.1, 0.3))
    assert found.prior.parts[0].mean == pytest.approx(-0.1)


def test_hyperparameters_from_samples_of_their_own() -> None:
    """With D_θ = D_t nothing is new but that they are not learned again; with another D_θ they are those of D_θ."""
    times = np.linspace(0, 6, 40)
    other = Samples(times, 0.3 * np.sin(4 * times) + 0.03 * np.random.default_rng(3).standard_normal(40))
    kernel, noise = SquaredExponential(), (0.001, 0.2)
    found = learned(learn_from={"position": other}, kernel=kernel, noise_std=noise)
    prior = JointPrior((Prior(kernel, noise),))
    least = best_solution(ConstrainedProblem((other,), prior, SearchSpace.around((other,), prior, 2)))
    assert isinstance(least, Solution)
    known = least.posterior.prior.hyperparameters
    for name in ("lengthscale", "signal_std"):
        assert found.hyperparameters[name] == pytest.approx(
            known[name], rel=0.02
        )  # position is not quite the flat output
    assert found.prior.learned == ()
    assert found.samples[0].values.tolist() == SHIFTED.values.tolist()
