"""What it costs to learn from fewer samples than there are."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.posterior import IllConditioned, Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples

_OF_L = 4.0  # twice the log of likelihoods: as much as one hyperparameter gains by chance
_OF_NOISE = 0.1  # σ_n


@dataclass(frozen=True)
class Condensation:
    """`centres` samples stood for `count` samples called `name`; they are compared with `beside` of them.

    `change_of_l` is l of the compared samples minus l of the centres, for the same hyperparameters, and `apart` is how
    far the two posterior means are apart at worst, at the times of both and halfway between these, in standard
    deviations σ_n of the noise. Both are those of all samples if `beside` is `count`, and estimates otherwise. None:
    they could not be computed in float64.
    """

    name: str
    count: int
    centres: int
    beside: int
    change_of_l: float | None
    apart: float | None

    @classmethod
    def of(cls, name: str, prior: Prior, fewer: Samples, more: Samples) -> Self:
        """Compare the posteriors of `fewer` and of `more` samples, which both stand for the same ones."""
        count = len(fewer) + fewer.scatter.count

        stencil = next(iter(fewer.by_name(name).values())).stencil
        times = np.unique(np.concatenate([fewer.times, more.times]))
        between = np.concatenate([times, (times[1:] + times[:-1]) / 2])

        def judged(samples: Samples) -> tuple[float, Array]:
            """Return l, and the posterior mean as the first kind of samples measures it; no large matrices are kept."""
            posterior = Posterior(prior, samples)
            return posterior.negative_log_likelihood, stencil.measured(posterior.signal, between)

        try:
            (l_one, one), (l_other, other) = judged(fewer), judged(more)
        except IllConditioned:
            return cls(name, count, len(fewer), len(more), None, None)
        apart = float(np.max(np.abs(other - one))) / prior.noise_std
        return cls(name, count, len(fewer), len(more), l_other - l_one, apart)

    @property
    def is_large(self) -> bool:
        """Whether all samples say something else: l by more than chance does, or the mean by more than is seen."""
        return abs(self.change_of_l or 0.0) > _OF_L or (self.apart or 0.0) > _OF_NOISE

    def __str__(self) -> str:
        said = f"of {self.count} samples of {self.name} by {self.centres} centres"
        if self.change_of_l is None or self.apart is None:
            return f"{said}, at a cost that could not be computed in float64"
        of = "all" if self.beside == self.count else f"{self.beside} centres (an estimate of what all would change)"
        mean = f"the mean by up to {self.apart:.2g} of the noise"
        return f"{said}: with {of}, l changes by {self.change_of_l:.2g} and {mean}"
