"""Windows that continue one another: without bounds the posterior of all samples, with bounds one reference, proved.

The second implementation learns from all samples at once.
"""

import numpy as np
import pytest

from tests.trackably.plants import AXIS, CART
from trackably import ConstrainedSystem, Matern52, Polytope, Samples, SquaredExponential
from trackably.certificates.certificate import Certificate
from trackably.checker.certificate import AllTimes, Claim, Window
from trackably.gp.joint import JointPrior
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.streams.windows import Stream, learn_proved
from trackably.systems.reference import Reference
from trackably.systems.sampling import sampled_signals

TIMES = np.cumsum(np.random.default_rng(7).uniform(0.05, 0.25, 120))
VALUES = -0.4 + 0.5 * np.sin(1.2 * TIMES) + 0.05 * np.random.default_rng(8).standard_normal(TIMES.size)
SAMPLES = Samples(TIMES, VALUES)
SMOOTH = SquaredExponential(0.6, 0.9)
TIGHT = ConstrainedSystem(AXIS.system, Polytope.box([-1.1, -0.5], [0.02, 0.5]), Polytope.box([-2.5], [2.5]))


@pytest.mark.parametrize("kernel", [SMOOTH, Matern52(0.6, 0.5)], ids=["smooth", "rough"])
@pytest.mark.parametrize("length", [3.0, 100.0])
def test_without_bounds_windows_give_the_posterior_mean_of_all_samples(kernel, length):
    """Of each flat output's own; one has none for longer than the kernel's memory."""
    seen, at = (TIMES < 4) | (TIMES > 12), np.linspace(0, 17, 400)
    free = ConstrainedSystem(CART.system, *(Polytope.box([-99, -99], [99, 99]),) * 2)
    samples = sampled_signals(free, {"a": SAMPLES, "b": Samples(TIMES[seen], VALUES[seen])})
    prior = JointPrior((Prior(kernel, 0.05, -0.4),) * 2, ("a", "b"))
    found = learn_proved(Stream(samples, prior, free, length, Window(0.0, 17.0)))
    assert isinstance(found, Certificate)
    for part, of, signal in zip(prior.parts, samples, found.reference.signals, strict=True):
        np.testing.assert_allclose(signal(at), Posterior(part, of).signal(at), atol=2e-4)


def stream(length: float, claim: Claim, samples: Samples = SAMPLES) -> Stream:
    """Return samples of positions with tight bounds."""
    seen = sampled_signals(TIGHT, {"position": samples})
    return Stream(seen, JointPrior((Prior(SMOOTH, 0.05, -0.4),), ("position",)), TIGHT, length, claim)


def learned(length: float, claim: Claim) -> Reference:
    found = learn_proved(stream(length, claim))
    assert isinstance(found, Certificate), found
    return found.reference


def test_with_bounds_windows_stay_near_the_function_of_all_samples_at_once():
    of, at = stream(5.0, Window(0.0, 17.0)), np.linspace(0, 17, 600)
    whole, windows = (learned(length, of.claim).signals[0](at) for length in (100.0, 5.0))
    bent = np.max(np.abs(whole - Posterior(of.prior.parts[0], of.samples[0]).signal(at)))
    assert bent > 0.05
    assert np.max(np.abs(windows - whole)) < 0.5 * bent


@pytest.mark.parametrize("claim", [Window(-2.0, 28.0), AllTimes()])
def test_bounds_are_kept_and_touched_across_all_windows(claim):
    states = learned(5.0, claim).state_at(np.linspace(0, 17, 20000))
    margins = np.minimum(states - TIGHT.state_set.lower, TIGHT.state_set.upper - states)
    assert [0 <= np.min(window) < 1e-4 for window in np.split(margins, 4)] == [True] * 4


def test_each_window_can_be_followed_by_rest():
    """A stream that stops at full speed towards its bound: the function turns in time, as nothing may follow."""
    full_speed = Samples(TIMES[TIMES < 4], -1.0 + 0.25 * TIMES[TIMES < 4])
    assert isinstance(learn_proved(stream(1.0, AllTimes(), full_speed)), Certificate)
