"""Several processes at once: names, what is shared, and that nothing else ties them together."""

from math import exp

import numpy as np
import pytest

from tests.trackably.gp import naive
from tests.trackably.gp.instances import over
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencil

TIMES = np.array([-0.7, 0.0, 0.2, 0.55, 1.0, 1.42, 2.3, 4.0])
SAMPLES = (
    Samples([0.0, 0.13, 0.4, 0.55, 0.9, 1.4], [1.0, 0.4, -0.3, 0.1, 0.8, 2.0]),
    Samples([0.1, 0.2, 0.9, 2.0], [3.0, 2.0, 2.5, 1.0], [1.0, 2.0, 0.5, 1.0], Stencil((-2.0, 2.0), 0.5)),
    Samples([0.5], [-1.0]),
)
PARTS = (
    Prior(Periodic(1.0, 0.8, 1.3), 0.2, 0.3).as_learned(),
    Prior(Periodic(2.0, 0.5, 1.3).as_learned(), 0.1, -1.0),
    Prior(Matern52(0.5, 0.8), 0.3, 0.0).as_learned(),
)
NAMES = ("x", "y", "z")
SHARED = PARTS[0], PARTS[1].with_hyperparameters({"lengthscale": 0.8}), PARTS[2]
PRIORS = {
    "apart": JointPrior(PARTS, NAMES),
    "two_shared": JointPrior(SHARED, NAMES, frozenset({"period", "lengthscale"})),
    "one_fixed": JointPrior((PARTS[0], PARTS[1].as_known(), PARTS[2]), NAMES),
    "nothing_learned": JointPrior(PARTS, NAMES).as_known(),
}


def known(prior: JointPrior) -> set[str]:
    return prior.hyperparameters.keys() - {*prior.learned}


def test_names_tell_the_process_unless_they_are_shared():
    assert PRIORS["two_shared"].learned == (
        "x.signal_std", "lengthscale", "period", "x.noise_std", "y.signal_std", "z.signal_std", "z.noise_std"
    )  # fmt: skip
    assert known(PRIORS["apart"]) == {"y.noise_std"}
    assert known(PRIORS["one_fixed"]) == {"y.signal_std", "y.lengthscale", "y.period", "y.noise_std"}


@over(PRIORS, "prior")
def test_logarithms_move_what_is_learned_and_nothing_else(prior):
    steps = np.arange(1, len(prior.learned) + 1) / 7
    moved = prior.with_log_hyperparameters(prior.log_hyperparameters + steps)
    step_of = dict(zip(prior.learned, steps, strict=True))
    expected = {name: value * exp(step_of.get(name, 0)) for name, value in prior.hyperparameters.items()}
    assert moved.hyperparameters == pytest.approx(expected, rel=1e-14)
    assert (moved.learned, moved.names, moved.shared) == (prior.learned, prior.names, prior.shared)
    assert moved.places == prior.places
    assert [part.mean for part in moved.parts] == [part.mean for part in prior.parts]


@over(PRIORS, "prior")
def test_likelihoods_add_up_means_are_their_own_and_gradients_central_differences(prior):
    joint = JointPosterior(prior, SAMPLES)
    singles = [Posterior(part, samples) for part, samples in zip(prior.parts, SAMPLES, strict=True)]
    value, gradient = joint.negative_log_marginal_likelihood()
    assert value == pytest.approx(sum(single.negative_log_marginal_likelihood()[0] for single in singles), rel=1e-14)

    def slopes(of) -> np.ndarray:
        return naive.by_log_hyperparameters(lambda at: of(JointPosterior(at, SAMPLES)), prior)

    likelihood_slopes = slopes(lambda at: at.negative_log_marginal_likelihood()[0])
    np.testing.assert_allclose(gradient, likelihood_slopes, rtol=1e-6, atol=1e-6)
    for i, single in enumerate(singles):
        jet, *by_theta = joint.jets(i, TIMES, 1)
        assert joint.signals[i](TIMES).tobytes() == single.signal(TIMES).tobytes()
        np.testing.assert_array_equal(jet, single.jets(TIMES, 1)[0])
        expected = slopes(lambda at, i=i: at.signals[i].jet(TIMES, 1))
        np.testing.assert_allclose(by_theta, expected, rtol=1e-5, atol=1e-6)
