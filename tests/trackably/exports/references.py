"""References that are exported, learned or given: on windows, for all times, of several plants, with bounds active."""

from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from tests.trackably.plants import AXIS, SAMPLES
from tests.trackably.systems.forms.instances import eight
from trackably import (
    CertifiedReference,
    ConstrainedSystem,
    LinearSystem,
    NonlinearSystem,
    Periodic,
    Polytope,
    Samples,
    SquaredExponential,
    TrackableReference,
    certify,
    learn_reference,
)
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove

KERNEL = SquaredExponential(0.3, 0.5)
TANK = ConstrainedSystem(
    NonlinearSystem.of(lambda x, u: [x[0] - 0.1 * x[0] ** 2 + 0.5 * u[0]], ["level"], ["inflow"], 0.2),
    Polytope.box([-1.0], [1.5]),
    Polytope.box([-1.0], [0.6]),
)
SWING = ConstrainedSystem(
    LinearSystem([[0.9]], [[0.5]], sampling_time=0.1, states=("angle",), inputs=("torque",)),
    Polytope.box([-1.0], [0.75]),
    Polytope.box([-1.0], [1.0]),
)


@cache
def on_window() -> TrackableReference:
    return learn_reference(SAMPLES, AXIS, KERNEL, (0.0, 3.0), noise_std=0.02, starts=1)


@cache
def all_times() -> TrackableReference:
    return learn_reference(SAMPLES, AXIS, KERNEL, "all_times", noise_std=0.02, mean=0.0, starts=1)


@cache
def periodic() -> TrackableReference:
    times = np.linspace(0.0, 4.0, 12)
    samples = Samples(times, 0.8 * np.sin(np.pi * times))
    kernel = Periodic(1.0, 1.0, period=2.0)
    return learn_reference(samples, SWING, kernel, "all_phases", noise_std=0.05, starts=1)


@cache
def nonlinear() -> TrackableReference:
    times = np.linspace(0.0, 3.0, 7)
    samples = Samples(times, np.sin(times))
    return learn_reference(samples, TANK, SquaredExponential(1.0, 1.0), (0.0, 3.0), noise_std=0.05, starts=1)


@cache
def given() -> CertifiedReference:
    """A curve that others made."""
    spline = CubicSpline([0.0, 1.0, 2.5, 3.5], [0.0, -0.4, -0.9, -0.7], bc_type="clamped")
    found = certify(spline, AXIS, "all_times")
    assert isinstance(found, CertifiedReference)
    return found


@cache
def robot() -> CertifiedReference:
    """Of a period, with a heading that passes π."""
    proof = prove(eight())
    assert isinstance(proof, Certificate)
    return CertifiedReference(proof)


EVERY = {of.__name__: of for of in (on_window, all_times, periodic, nonlinear, given)}
