"""Windows that continue one another: without bounds the posterior of all samples, with bounds one reference, proved.

The second implementation learns from all samples at once.
"""

import numpy as np
import pytest

from tests.trackably.plants import AXIS, CART
from trackably import ConstrainedSystem, Matern52, Polytope, Samples, SquaredExponential
from trackably.certificates.certificate import Certificate
from trackably.certificates.claim import as_claim
from trackably.checker.certificate import AllTimes, Window
from trackably.gp.joint import JointPrior
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.streams.windows import Stream, learn_proved
from trackably.systems.sampling import sampled_signals

TIMES = np.cumsum(np.random.default_rng(7).uniform(0.05, 0.25, 120))
VALUES = -0.4 + 0.5 * np.sin(1.2 * TIMES) + 0.05 * np.random.default_rng(8).standard_normal(TIMES.size)
SAMPLES = Samples(TIMES, VALUES)
KERNELS = {"smooth": SquaredExponential(0.6, 0.9), "rough": Matern52(0.6, 1.2)}
FREE = ConstrainedSystem(AXIS.system, Polytope.box([-9, -9], [9, 9]), Polytope.box([-99], [99]))
TIGHT = ConstrainedSystem(AXIS.system, Polytope.box([-1.1, -0.5], [0.02, 0.5]), Polytope.box([-2.5], [2.5]))
each_kernel = pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)


def stream(kernel, plant, length, claim=(0.0, 17.0), mean=-0.4) -> Stream:
    _, seen = sampled_signals(plant, {"position": SAMPLES})
    return Stream(seen, JointPrior((Prior(kernel, 0.05, mean),), ("position",)), plant, length, as_claim(claim))


def learned(*given, **more):
    found = learn_proved(stream(*given, **more))
    assert isinstance(found, tuple), found.explanation
    return found


@each_kernel
@pytest.mark.parametrize("length", [3.0, 100.0])
def test_without_bounds_windows_give_the_posterior_mean_of_all_samples(kernel, length):
    of = stream(kernel, FREE, length)
    reference, certificate = learned(kernel, FREE, length)
    assert isinstance(certificate, Certificate)
    mean = Posterior(of.prior.parts[0], of.samples[0]).mean(at := np.linspace(0, 17, 400))
    np.testing.assert_allclose(reference.signals[0](at), mean, atol=2e-4)


def test_one_flat_output_is_learned_where_another_has_no_samples():
    """For longer than the kernel's memory: each is the posterior mean of its own samples."""
    kernel, seen = Matern52(0.6, 0.5), (TIMES < 4) | (TIMES > 12)
    free = ConstrainedSystem(CART.system, *(Polytope.box([-99, -99], [99, 99]),) * 2)
    _, samples = sampled_signals(free, {"a": SAMPLES, "b": Samples(TIMES[seen], VALUES[seen])})
    prior = JointPrior((Prior(kernel, 0.05, -0.4),) * 2, ("a", "b"))
    found = learn_proved(Stream(samples, prior, free, 3.0, Window(0.0, 17.0)))
    assert isinstance(found, tuple)
    for part, of, signal in zip(prior.parts, samples, found[0].signals, strict=True):
        mean = Posterior(part, of).mean(at := np.linspace(0, 17, 400))
        np.testing.assert_allclose(signal(at), mean, atol=2e-4)


def test_with_bounds_windows_stay_near_the_function_of_all_samples_at_once():
    of, at = stream(KERNELS["smooth"], TIGHT, 5.0), np.linspace(0, 17, 600)
    (whole,), (windows,) = (learned(KERNELS["smooth"], TIGHT, length)[0].signals for length in (100.0, 5.0))
    bent = np.max(np.abs(whole(at) - Posterior(of.prior.parts[0], of.samples[0]).mean(at)))
    assert bent > 0.05
    assert np.max(np.abs(windows(at) - whole(at))) < 0.5 * bent


@pytest.mark.parametrize("claim", [(-2.0, 28.0), "all_times"])
def test_bounds_are_kept_and_touched_across_all_windows(claim):
    reference, _ = learned(KERNELS["smooth"], TIGHT, 5.0, claim=claim)
    states = reference.state_at(np.linspace(0, 17, 20001))
    lower, upper = TIGHT.state_set.lower, TIGHT.state_set.upper
    assert np.all((lower <= states) & (states <= upper))
    for window in np.split(states[:20000], 4):  # each touches a bound
        assert min(np.min(window - lower), np.min(upper - window)) < 1e-4


def test_each_window_can_be_followed_by_rest():
    """A stream that stops at full speed towards its bound: the function turns in time, as nothing may follow."""
    full_speed = Samples(TIMES[TIMES < 4], -1.0 + 0.25 * TIMES[TIMES < 4])
    _, seen = sampled_signals(TIGHT, {"position": full_speed})
    prior = JointPrior((Prior(KERNELS["smooth"], 0.05, -0.4),), ("position",))
    found = learn_proved(Stream(seen, prior, TIGHT, 1.0, AllTimes()))
    assert isinstance(found, tuple)
