"""Assumptions 4 and 5 of the paper: κ decays everywhere, |κ̇| beyond ζ(θ), and ζ is not larger than it must be."""

import numpy as np
from hypothesis import given
from mpmath import mp

from tests.trackably.gp.instances import DECAYING, RADIAL, decaying_kernels, formula, over


def falls_strictly(values) -> bool:
    return bool(np.all(np.diff(values) < 0))


def later(kernel, zeta):
    """Times from ζ on, as long as κ is a normal float."""
    r = zeta * np.linspace(1, 12, 300)
    return r[kernel(r) > 1e-290]


@over(DECAYING)
def test_kernel_falls_everywhere_and_its_derivative_beyond_the_decay_distance(kernel):
    r = kernel.decay_distance * np.linspace(0, 12, 400)
    r = r[kernel(r) > 1e-290]
    assert np.all(kernel(r) > 0)
    assert falls_strictly(kernel(r))
    assert np.all(kernel.jet(r[1:], 1)[1] < 0)
    far = later(kernel, kernel.decay_distance)
    assert far.size > 30
    assert falls_strictly(np.abs(kernel.jet(far, 1)[1]))


@given(decaying_kernels)
def test_derivative_of_any_decaying_kernel_falls_beyond_the_decay_distance(kernel):
    r = later(kernel, kernel.decay_distance * (1 + 1e-9))
    assert falls_strictly(kernel(r))
    assert falls_strictly(np.abs(kernel.jet(r, 1)[1]))


@over(RADIAL)
def test_decay_distance_is_sharp(kernel):
    """|κ̇| still rises right before ζ, and has its slope zero at ζ."""
    zeta = kernel.decay_distance
    rising = np.abs(kernel.jet(zeta * np.linspace(0.9, 0.9999, 200), 1)[1])
    assert np.all(np.diff(rising) > 0)
    with mp.workdps(30):
        curvature = float(mp.diff(formula(kernel), mp.mpf(zeta), 2))
    assert abs(curvature) < 1e-13 * kernel.signal_std**2 / kernel.lengthscale**2
