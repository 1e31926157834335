"""A disturbance that is zero is still named: the robust statement never reads as a sentence without its object."""

import numpy as np

from trackably import ConstrainedSystem, LinearSystem, Polytope, Samples, SquaredExponential, Zonotope, learn_reference


def test_a_disturbance_set_of_zero_alone_is_named() -> None:
    plant = ConstrainedSystem(
        LinearSystem(A=[[0.9]], B=[[0.5]], sampling_time=0.01),
        Polytope.box([-2.0], [0.05]),
        Polytope.box([-0.5], [0.5]),
    )
    reference = learn_reference(
        Samples(np.arange(6) / 10, [-1.0, -0.4, -0.05, 0.0, 0.0, 0.0]),
        plant,
        SquaredExponential(),
        "all_times",
        noise_std=0.01,
        disturbance=Zonotope.box([0.0], [0.0]),
    )
    assert "under every disturbance in [0, 0], from every start" in reference.explanation
