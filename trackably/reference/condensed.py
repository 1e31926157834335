"""Replace the samples of a short interval by a few; this is exact for every signal that is a polynomial there.

Let samples y_i = g(t_i) + ε_i have noise of variance σ_n²/w_i, and let g be a polynomial of a degree below d. Gauss's
quadrature for the measure Σ_i w_i δ(t − t_i) has d nodes τ_a and masses λ_a > 0; the Lagrange polynomials L_a of these
nodes are orthogonal, Σ_i w_i L_a(t_i) L_b(t_i) = λ_a δ_ab. So

    Σ_i w_i (y_i − g(t_i))² = Σ_a λ_a (Y_a − g(τ_a))² + R,    Y_a = Σ_i w_i L_a(t_i) y_i / λ_a.

So d samples Y_a of g at τ_a, with independent noise of variance σ_n²/λ_a, say the same about g; the sum of squares R
does not depend on g.

The new samples are called centres. A user chooses their largest number, or "auto" for as few as represent the samples
well. `Condensation` compares the negative log marginal likelihood l and the posterior mean given the centres with those
given all samples.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, Self

import numpy as np

from trackably.arguments import whole
from trackably.arrays import Array
from trackably.gp.posterior import IllConditioned, Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import ResidualStatistics, Samples

NODES = 4
"""The number d of centres in each interval. For a smooth signal, the error is of order d in the interval's length."""


def condensed_bin(times: Array, values: Array, relative_noise: Array) -> tuple[Array, Array, Array, ResidualStatistics]:
    """Return times [s], values and relative noises of 4 samples that replace n, and statistics of the residuals.

    If n is at most 4, return the given samples, and no residuals. The orthonormal polynomials at the samples are the
    columns of Q in a QR decomposition of √w times the powers of t. The nodes are the eigenvalues of Qᵀ diag(t) Q, the
    Jacobi matrix (Golub and Welsch, 1969).
    """
    if len(times) <= NODES:
        return times, values, relative_noise, ResidualStatistics()
    middle, half = (times[0] + times[-1]) / 2, (times[-1] - times[0]) / 2
    x, root = (times - middle) / half, 1 / relative_noise
    q, _ = np.linalg.qr(root[:, None] * np.polynomial.legendre.legvander(x, NODES - 1))
    nodes, directions = np.linalg.eigh(q.T @ (x[:, None] * q))
    at_nodes = q @ directions  # the columns √w L_a/√λ_a, orthonormal, one for each node
    root_of_mass = root @ at_nodes
    along = (root * values) @ at_nodes
    left = root * values - at_nodes @ along
    scale = 2 * float(np.sum(np.log(relative_noise)) + np.sum(np.log(np.abs(root_of_mass))))
    scatter = ResidualStatistics(len(times) - NODES, float(left @ left), scale)
    return middle + half * nodes, along / root_of_mass, 1 / np.abs(root_of_mass), scatter


_OF_L = 4.0  # a larger change of l = −2 ln p counts as significant: a useless hyperparameter may change l by this much
_OF_NOISE = 0.1  # part of σ_n: a change of the posterior mean by more than this is visible in plots


@dataclass(frozen=True)
class Condensation:
    """The effect of replacing `count` samples of `name` by a smaller number of samples, called `centres`.

    The centres are compared with `beside` samples: all samples, or a larger number of centres. `change_of_l` is l = −2
    ln p of the `beside` samples minus l of the centres, for the same hyperparameters. `apart` is the largest distance
    between the two posterior means, in standard deviations σ_n of the noise; means are compared at the times of both
    sets and halfway between these. Both numbers are exact if `beside` is `count`, and estimates otherwise. They are
    None if they could not be computed in float64.
    """

    name: str
    count: int
    centres: int
    beside: int
    change_of_l: float | None
    apart: float | None

    @classmethod
    def of(cls, name: str, prior: Prior, fewer: Samples, more: Samples) -> Self:
        """Compare the posteriors given `fewer` and given `more` samples; both sets represent the same recording."""
        count = len(fewer) + fewer.scatter.count

        stencil = next(iter(fewer.by_name(name).values())).stencil
        times = np.unique(np.concatenate([fewer.times, more.times]))
        between = np.concatenate([times, (times[1:] + times[:-1]) / 2])

        def evaluate(samples: Samples) -> tuple[float, Array]:
            """Return l and the posterior mean of the first sampled state at the times `between`.

            A function of its own, so that its large matrices are freed when it returns.
            """
            posterior = Posterior(prior, samples)
            return posterior.negative_log_likelihood, stencil.measured(posterior.signal, between)

        try:
            (l_one, one), (l_other, other) = evaluate(fewer), evaluate(more)
        except IllConditioned:
            return cls(name, count, len(fewer), len(more), None, None)
        apart = float(np.max(np.abs(other - one))) / prior.noise_std
        return cls(name, count, len(fewer), len(more), l_other - l_one, apart)

    @property
    def is_large(self) -> bool:
        """Whether l changes by more than 4, or the posterior mean by more than a tenth of σ_n."""
        return abs(self.change_of_l or 0.0) > _OF_L or (self.apart or 0.0) > _OF_NOISE

    def __str__(self) -> str:
        said = f"of {self.count} samples of {self.name} by {self.centres} centres"
        if self.change_of_l is None or self.apart is None:
            return f"{said}, at a cost that could not be computed in float64"
        of = "all" if self.beside == self.count else f"{self.beside} centres (an estimate of what all would change)"
        mean = f"the mean by up to {self.apart:.2g} of the noise"
        return f"{said}: with {of}, −2 ln p changes by {self.change_of_l:.2g} and {mean}"


_LEAST_GAIN = 4  # the search begins with one centre for this many samples
_LOST = 0.01  # fewer centres may increase the mean square residual of polynomials by this part, in addition to chance
_DEVIATIONS = 3.0  # an increase of the mean square by fewer of its standard deviations than this counts as chance


def condense(samples: Samples, centres: int) -> Samples:
    """Return at most `centres` samples that represent all `samples`; return `samples` if they are no more than that.

    The time between the first sample and the last is divided into equal bins, and the samples in each bin are replaced
    by 4. Nothing is lost for a signal that is a cubic polynomial in each bin. There are at least 4 `centres`, and the
    samples are of one kind, for example positions.
    """
    if len(samples) <= centres:
        return samples
    ends = np.linspace(samples.times[0], samples.times[-1], centres // NODES + 1)[1:-1]
    cuts = [0, *np.searchsorted(samples.times, ends).tolist(), len(samples)]
    arrays = samples.times, samples.values, samples.relative_noise
    bins = (condensed_bin(*(array[a:b] for array in arrays)) for a, b in pairwise(cuts) if a < b)
    *condensed, scatters = zip(*bins, strict=True)
    times, values, noise = map(np.concatenate, condensed)
    return Samples(times, values, noise, samples.stencil, (sum(scatters, samples.scatter),))


def condensed_enough(samples: Samples, noise_std: float | None = None) -> Samples:
    """Return the smallest set of samples, called centres, that represents all samples without much larger residuals.

    Residuals are those of polynomials fitted in each interval of time, so they do not depend on a kernel
    (`Condensation` judges the loss for a kernel). If half as many centres as samples are not enough, return all
    samples.

    The search begins with a quarter as many centres as samples. It halves their number while the mean square residual
    of the polynomials exceeds that of the first number by at most 1 %, plus an allowance for chance. Both are relative
    to σ_n² if `noise_std` σ_n is known and σ_n² is larger than that residual. The search does not begin with few
    centres, because two small numbers of centres have equal residuals if neither resolves the signal. The smallest
    number that passes is doubled, to lose far less still. If no number below a quarter passes, the search begins again
    with half as many centres as samples.
    """
    quarter, half = len(samples) // _LEAST_GAIN, len(samples) // 2
    for finest in (quarter, half):
        centres, allowed = finest, _allowance(samples, finest, noise_std)
        while centres // 2 >= NODES and condense(samples, centres // 2).scatter.mean_square <= allowed:
            centres //= 2
        if centres < finest:
            return condense(samples, 2 * centres)
    return samples


def _allowance(samples: Samples, finest: int, noise_std: float | None) -> float:
    """Return the largest mean square residual of polynomials that is allowed for fewer centres than f = `finest`.

    The n samples have n − f residuals, and up to n with fewer centres. Even if all are noise, the mean squares of n − f
    and of n residuals differ by chance, with the relative standard deviation √(2/n · f/(n − f)).
    """
    least = condense(samples, finest).scatter.mean_square
    chance = _DEVIATIONS * np.sqrt(2 / len(samples) * finest / (len(samples) - finest))
    return float(least + (_LOST + chance) * max(least, (noise_std or 0.0) ** 2))


MANY = 500
"""Largest number of samples of one name that are not condensed by default."""

Centres = int | Literal["auto"] | None
"""Largest number of centres for the samples of each name; "auto": as few as needed; None: each sample is a centre."""


def checked_centres(given: object) -> Centres:
    """Return the option `centres`. TypeError or ValueError unless it is "auto", None or a whole number of 4 or more."""
    if given is None:
        return None
    is_auto = isinstance(given, str) and given == "auto"
    return "auto" if is_auto else whole('centres (or "auto", or None)', given, least=NODES)


def represented(samples: Samples, centres: Centres, noise_std: float | None, times: int = 1) -> Samples:
    """Return the samples to learn from, at most as many as `centres` allows; σ_n is `noise_std` if it is known.

    "auto" keeps up to 500 samples. If there are more, it chooses as many centres as the samples need, multiplied by
    `times` (larger than 1 if the kernel needs more centres). If this number exceeds half of the samples, it keeps all.
    """
    if centres is None or (centres == "auto" and len(samples) <= MANY):
        return samples
    if centres != "auto":
        return condense(samples, centres)
    few = condensed_enough(samples, noise_std)
    if times == 1 or len(few) == len(samples):
        return few
    return condense(samples, times * len(few)) if 2 * times * len(few) <= len(samples) else samples
