"""Slow motions whose inputs are long at their bounds are followed: rounding errors leave room for a proof."""

import numpy as np

from trackably import (
    ConstrainedSystem,
    LinearSystem,
    Polytope,
    Samples,
    SquaredExponential,
    learn_reference,
)


def test_a_sine_with_less_acceleration_than_it_takes():
    """With 80 % of it, and 100 steps a second. Without sums of few kernels nothing is proved."""
    omega, times = 2 * np.pi / 60, np.linspace(0, 60, 50)
    samples = Samples(times, np.sin(omega * times) + 0.01 * np.random.default_rng(2).standard_normal(times.size))
    system = LinearSystem.discretised([[0, 1], [0, 0]], [[0], [1]], 0.01, states=["p", "v"], inputs=["a"])
    wide, a = 10 * omega, 0.8 * omega**2
    plant = ConstrainedSystem(system, Polytope.box([-2.0, -wide], [2.0, wide]), Polytope.box([-a], [a]))
    found = learn_reference({"p": samples}, plant, SquaredExponential(), "recorded", noise_std=0.02, starts=1)
    assert found.method == "joint"
    assert found.misfit["p"] < 0.04
