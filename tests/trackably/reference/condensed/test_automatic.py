"""An automatic number of centres: l and the mean are those of all samples, between the centres too, for every kernel.

The naive second implementation has the matrix of all samples.
"""

import numpy as np
import pytest

from tests.trackably.gp import naive
from tests.trackably.gp.instances import over
from trackably import (
    ConstrainedSystem,
    LinearSystem,
    Matern32,
    Polytope,
    Samples,
    SquaredExponential,
    learn_reference,
    learn_stream,
)
from trackably.gp.joint import JointPosterior

CART = ConstrainedSystem(
    LinearSystem([[1.0]], [[0.1]], states=("position",), inputs=("velocity",), sampling_time=0.1),
    Polytope.box([-1.2], [0.3]),
    Polytope.box([-3.0], [3.0]),
)
MEAN, NOISE = -0.45, 0.05
OF_NOISE, OF_L = 0.12, 4.0  # the mean is compared on a finer grid than the one by which centres are chosen


def drawn(count: int, speed: float) -> Samples:
    rng = np.random.default_rng(0)
    times = 0.1 * (np.arange(count) + 0.4 * rng.uniform(0, 1, count))
    values = MEAN + 0.5 * np.sin(speed * times + np.sin(0.13 * speed * times))
    return Samples(times, values + NOISE * rng.standard_normal(count))


ROUGH, SMOOTH = Matern32(0.7, 1.5), SquaredExponential(0.6, 0.5)
CASES = {
    "known, rough": (learn_reference, ROUGH, 1.4, {"noise_std": NOISE}),
    "known, smooth": (learn_reference, SMOOTH, 0.1, {"noise_std": NOISE}),
    "learned": (learn_reference, Matern32(), 0.3, {"noise_std": (0.01, 0.2), "starts": 2}),
    "stream, rough": (learn_stream, ROUGH, 0.3, {"noise_std": NOISE, "window": 15.0}),
    "stream, smooth": (learn_stream, SMOOTH, 0.3, {"noise_std": NOISE, "window": 15.0}),
}


@over(CASES, "learn", "kernel", "speed", "options")
def test_l_and_the_mean_given_the_centres_are_those_given_all_samples(learn, kernel, speed, options):
    """The mean on a fine grid, at worst, in σ_n."""
    samples = drawn(600, speed)
    found = learn(samples, CART, kernel, (0.0, 50.0), mean=MEAN, **options)
    (part,) = found.prior.parts
    posterior = JointPosterior(found.prior, found.samples)
    at = np.linspace(samples.times[0], samples.times[-1], 3 * len(samples))
    apart = np.max(np.abs(posterior.signals[0](at) - naive.mean(part, samples, at)))
    nlml = naive.negative_log_marginal_likelihood(part, samples)
    assert posterior.negative_log_marginal_likelihood()[0] == pytest.approx(nlml, rel=0, abs=OF_L)
    assert apart <= OF_NOISE * float(part.noise_std)


def test_samples_to_learn_hyperparameters_from_are_as_many_as_these_need():
    samples, few = drawn(600, 0.3), drawn(60, 0.3)
    asked = {"claim": (0.0, 5.0), "noise_std": (0.01, 0.2), "mean": MEAN, "starts": 2, "learn_from": samples}
    one, other = (learn_reference(few, CART, Matern32(), **asked, centres=given) for given in ("auto", None))
    assert one.hyperparameters == pytest.approx(other.hyperparameters, rel=0.02)
