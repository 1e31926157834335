"""Length scales end where float64 can no longer evaluate the reference: a harmless motion of a long chain is proved."""

import re

import numpy as np
import pytest

from trackably import (
    ConstrainedSystem,
    LinearSystem,
    Periodic,
    Polytope,
    Proved,
    Samples,
    TrackableReference,
    check,
    learn_reference,
)
from trackably.learning.problem import Method

LIMITS = np.array([4, 2.2, 3.5, 8.0])


def chain_of_four(sampling_time: float) -> ConstrainedSystem:
    """Four integrators, of which the input is the fourth difference of the first state."""
    system = LinearSystem.discretised(
        np.eye(4, k=1), np.eye(4)[:, 3:], sampling_time, states=("a", "b", "c", "d"), inputs=("u",)
    )
    return ConstrainedSystem(system, Polytope.box(-LIMITS, LIMITS), Polytope.box([-60], [60]))


def learned(sampling_time: float, noise: float, kernel: Periodic, method: Method = "joint") -> TrackableReference:
    times = np.linspace(0, 16, 60)
    values = 2 * np.sin(2 * np.pi * times / 8) + noise * np.random.default_rng(0).standard_normal(times.size)
    samples = Samples(times, values)
    return learn_reference(samples, chain_of_four(sampling_time), kernel, "all_phases", method=method, starts=1)


@pytest.mark.parametrize(("method", "sampling_time", "noise"), [("joint", 0.01, 0.02)])
def test_a_sine_is_proved_and_followed(method: Method, sampling_time: float, noise: float, tmp_path):
    found = learned(sampling_time, noise, Periodic(), method)
    for file in found.save_certificate(tmp_path / "sine.json"):
        assert isinstance(check(file), Proved)
    assert found.misfit["a"] < 1.05 * noise
    assert found.price == pytest.approx(0.0, abs=1e-3)
    assert re.search(r"lengthscale = [0-9.]+: float64 does not evaluate those twice as long", found.explanation)
    found.save(tmp_path / "saved.json")
    assert TrackableReference.load(tmp_path / "saved.json").explanation == found.explanation
