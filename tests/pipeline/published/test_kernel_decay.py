"""Assumptions 4 and 5 of the paper: κ decays everywhere, |κ̇| beyond ζ(θ), and ζ is not larger than it must be."""

import numpy as np
from hypothesis import given
from mpmath import mp

from pipeline.published.algorithm1 import decay_distance
from tests.trackably.gp.instances import DECAYING, RADIAL, decaying_kernels, formula, over


def assert_falls(kernel, zeta):
    """κ falls from 0 on, and |κ̇| from ζ on, as long as κ is a normal float."""
    r = zeta * np.linspace(0, 12, 400)
    r = r[kernel(r) > 1e-290]
    value, slope = kernel.jet(r, 1)
    assert np.all(np.diff(value) < 0)
    assert np.all(slope[1:] < 0)
    assert np.all(np.diff(np.abs(slope[r >= zeta])) < 0)


@over(DECAYING)
def test_a_kernel_falls_everywhere_and_its_derivative_beyond_the_decay_distance(kernel):
    assert_falls(kernel, decay_distance(kernel))


@given(decaying_kernels)
def test_any_decaying_kernel_does(kernel):
    assert_falls(kernel, decay_distance(kernel) * (1 + 1e-9))


@over(RADIAL)
def test_decay_distance_is_sharp(kernel):
    """|κ̇| still rises right before ζ, and has its slope zero at ζ."""
    zeta = decay_distance(kernel)
    rising = np.abs(kernel.jet(zeta * np.linspace(0.9, 0.9999, 200), 1)[1])
    assert np.all(np.diff(rising) > 0)
    with mp.workdps(30):
        curvature = float(mp.diff(formula(kernel), mp.mpf(zeta), 2))
    assert abs(curvature) < 1e-13 * kernel.signal_std**2 / kernel.lengthscale**2
