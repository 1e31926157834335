"""Find starting points: compare the likelihood at many length scales and periods, with amplitudes of the samples' size.

The objective of a periodic kernel has a local minimum at nearly every period that samples do not exclude, and a few
starts find only a few of them.
"""

from dataclasses import replace

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.prior import NOISE
from trackably.gp.samples import Samples
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import amplitude

_POINTS = 600
_MOST_SAMPLES = 100  # most samples used of one signal
# Two starts have to differ by more than this in some ln θ, otherwise only the better one is kept.
_APART = {"lengthscale": 0.5, "period": 0.05, NOISE: 0.5}


def can_screen(prior: JointPrior) -> bool:
    """Whether all kernels are `Periodic`."""
    return all(isinstance(part.kernel, Periodic) for part in prior.parts)


def screen(problem: ConstrainedProblem, keep: int) -> list[Array]:
    """Return ln θ of up to `keep` starts, the likeliest first, if all kernels are `Periodic`.

    Bounds are ignored. If a signal has many samples, only some are used.
    """
    samples = tuple(map(_few, problem.samples))
    few = replace(problem, samples=samples, constraints=(), required=())
    points, names = problem.space.points(_POINTS), problem.prior.learned
    for part, of, places in zip(problem.prior.parts, samples, problem.prior.places, strict=True):
        if "signal_std" in part.learned:
            points[:, places[part.learned.index("signal_std")]] = np.log(amplitude(of, part))
    points = np.clip(points, problem.space.log_lower, problem.space.log_upper)
    apart = np.array([_APART.get(name.rsplit(".", 1)[-1], np.inf) for name in names])
    kept: list[Array] = []
    for point in points[np.argsort([few.nlml(point) for point in points], kind="stable")]:
        if len(kept) < keep and (not kept or (np.abs(point - kept) > apart).any(axis=1).all()):
            kept.append(point)
    return kept


def _few(samples: Samples) -> Samples:
    """Return every k-th sample, with the smallest k that leaves at most `_MOST_SAMPLES`."""
    if len(samples) <= _MOST_SAMPLES:
        return samples
    chosen = np.arange(0, len(samples), -(-len(samples) // _MOST_SAMPLES))
    found = samples.times[chosen], samples.values[chosen], samples.relative_noise[chosen]
    return Samples(*found, samples.stencil.only(chosen))
