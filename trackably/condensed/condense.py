"""Samples at their own rate as fewer ones: a given number of them, or as few as the samples allow."""

from itertools import pairwise

import numpy as np

from trackably.condensed.bins import NODES, Condensed, condensed_bin
from trackably.gp.samples import Samples, Scatter
from trackably.gp.stencils import Stencils

_LEAST_GAIN = 4  # samples for each centre: for fewer it is not worth the while
_LOST = 0.01  # of the mean square of what polynomials leave
_DEVIATIONS = 3.0  # standard deviations that are chance: a mean square of n normal numbers has √(2/n) of itself


def condensed(samples: Samples, centres: int) -> Samples:
    """Return at most `centres` samples that stand for all of them; the same where they are no more.

    The time between the first sample and the last is divided into equal bins. In each the samples are those of
    `condensed_bin`: nothing is lost of a signal that is a cubic polynomial in each bin. ValueError: fewer centres than
    one bin needs, or samples of several kinds.
    """
    if len(samples) <= centres:
        return samples
    if centres < NODES:
        raise ValueError(f"centres: at least {NODES} are needed, got {centres}")
    if isinstance(samples.stencil, Stencils):
        raise ValueError("centres: samples of several kinds must be condensed before they are joined")
    ends = np.linspace(samples.times[0], samples.times[-1], centres // NODES + 1)[1:-1]
    cuts = [0, *np.searchsorted(samples.times, ends).tolist(), len(samples)]
    bins = [_bin(samples, slice(a, b)) for a, b in pairwise(cuts) if a < b]
    scatter = sum((each.scatter for each in bins), samples.scatter)
    times, values, noise = (np.concatenate(parts) for parts in zip(*(each[:3] for each in bins), strict=True))
    return Samples(times, values, noise, samples.stencil, (scatter,))


def condensed_enough(samples: Samples, noise_std: float | None = None) -> Samples:
    """Return as few samples as leave hardly more of all to the noise; all of them where half is not enough.

    That is what samples say, whatever the kernel: `Condensation` says what they lose for a kernel.

    From a quarter on, centres are halved while the mean square of what polynomials leave grows by less than 1 % and
    what chance explains: percentages of σ_n² where `noise_std` σ_n is known and larger. It would be wrong to begin with
    few: two numbers of centres leave the same where neither resolves the signal. The fewest that pass are doubled, to
    lose far less still. Where less than a quarter does not pass, a quarter does if it leaves no more than half of them.
    """
    quarter, half = len(samples) // _LEAST_GAIN, len(samples) // 2
    for finest in (quarter, half):
        centres, allowed = finest, _allowed(samples, finest, noise_std)
        while centres // 2 >= NODES and _mean_square(condensed(samples, centres // 2).scatter) <= allowed:
            centres //= 2
        if centres < finest:
            return condensed(samples, 2 * centres)
    return samples


def _allowed(samples: Samples, finest: int, noise_std: float | None) -> float:
    """Return the mean square that fewer centres than the `finest` may leave."""
    least = _mean_square(condensed(samples, finest).scatter)
    chance = _DEVIATIONS * np.sqrt(2 / len(samples) * finest / (len(samples) - finest))
    return float(least + (_LOST + chance) * max(least, (noise_std or 0.0) ** 2))


def finer(samples: Samples, fewer: Samples, most: int) -> Samples:
    """Return samples to compare `fewer` with: all where they are no more than `most`, or twice as many as `fewer`."""
    return samples if len(samples) <= most else condensed(samples, 2 * len(fewer))


def _bin(samples: Samples, of: slice) -> Condensed:
    return condensed_bin(samples.times[of], samples.values[of], samples.relative_noise[of])


def _mean_square(scatter: Scatter) -> float:
    return scatter.squares / max(scatter.count, 1)
