"""Slow motions whose inputs are long at their bounds are followed: rounding errors leave room for a proof."""

import warnings

import numpy as np

from trackably import (
    ConstrainedSystem,
    DoubtfulInputWarning,
    LinearSystem,
    Polytope,
    Samples,
    SquaredExponential,
    learn_reference,
)


def test_a_sine_with_less_acceleration_than_it_takes():
    """With 80 % of it, and 100 steps a second. Without sums of few kernels, hyperparameters alone are left: 0.088."""
    omega, times = 2 * np.pi / 60, np.linspace(0, 60, 50)
    samples = Samples(times, np.sin(omega * times) + 0.01 * np.random.default_rng(2).standard_normal(times.size))
    system = LinearSystem.discretised([[0, 1], [0, 0]], [[0], [1]], 0.01, states=["p", "v"], inputs=["a"])
    wide, a = 10 * omega, 0.8 * omega**2
    plant = ConstrainedSystem(system, Polytope.box([-2.0, -wide], [2.0, wide]), Polytope.box([-a], [a]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DoubtfulInputWarning)  # noise learned with the bounds is larger
        found = learn_reference({"p": samples}, plant, SquaredExponential(), "recorded")
    assert found.method == "joint"
    assert found.misfit["p"] < 0.04
