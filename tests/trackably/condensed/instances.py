"""Samples at their own rate: regular, with jitter, with a gap, with unequal noise, through a stencil."""

import numpy as np

from trackably import Samples
from trackably.gp.stencil import Stencil

RANDOM = np.random.default_rng(5)
REGULAR = np.arange(240) / 60
JITTER = np.cumsum(RANDOM.uniform(0.004, 0.03, 240))


def seen(times, **given):
    return Samples(times, np.sin(2 * times) + 0.1 * np.cos(times) * RANDOM.standard_normal(times.size), **given)


INSTANCES = {
    "regular": seen(REGULAR),
    "jitter": seen(JITTER),
    "gap": seen(np.delete(JITTER, slice(60, 170))),
    "unequal noise": seen(JITTER, relative_noise=RANDOM.uniform(0.5, 3.0, 240)),
    "far from zero": seen(1e4 + REGULAR),
    "velocities": seen(REGULAR, stencil=Stencil((-20.0, 20.0), step=0.05)),
}
