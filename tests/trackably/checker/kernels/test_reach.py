"""Sizes of kernels are bounded at all distances, and beyond each; beyond its reach a kernel is as small as is said."""

import numpy as np

from tests.trackably.checker.kernels.instances import checked
from tests.trackably.gp.instances import DECAYING, KERNELS, over, time_scale
from trackably.checker.intervals import exactly
from trackably.checker.kernels import reach
from trackably.gp.kernels.rational_quadratic import RationalQuadratic

PART = exactly(2) ** -20


@over(KERNELS)
def test_bounds_beyond_a_distance_and_sizes(kernel):
    own, r = checked(kernel), np.linspace(0, 9, 20_001) * time_scale(kernel)
    value, slope = np.abs(kernel.jet(r, 1))
    for part in (0.0, 0.03, 0.1, 0.2399, 0.24, 0.2759, 0.28, 0.6, 0.99, 2.0, 8.0):
        later = r >= part * time_scale(kernel)
        for bound, found in zip(own.beyond(exactly(part * time_scale(kernel))), (value, slope), strict=True):
            assert np.max(found[later]) <= float(bound.b) * (1 + 1e-12)
    for bound, found in zip(own.sizes(exactly(r[-1])), (value, slope, r * slope, r * value), strict=False):
        assert np.max(found) <= float(bound.b) * (1 + 1e-12)


@over(DECAYING)
def test_beyond_its_reach_a_kernel_is_small(kernel):
    """Also if it is longer than the centres last: boxes far from all of them are proved by it."""
    own, short = checked(kernel), time_scale(kernel)
    for span in (300 * short, short):
        distance, decay = reach(own, span, PART)
        if isinstance(kernel, RationalQuadratic) and kernel.shape < 1:
            assert distance == np.inf
        else:
            assert distance < 20 * short
            assert decay == own.beyond(exactly(distance))
            assert decay.size <= PART * float(kernel(0.0)) * (1 + 1e-12)
