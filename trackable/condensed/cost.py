"""What it costs to learn from fewer samples than there are."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from trackable.gp.posterior import IllConditioned, Posterior
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples


@dataclass(frozen=True)
class Condensation:
    """`centres` samples stood for `count` samples called `name`; they are compared with `beside` of them.

    `change_of_l` is l of the compared samples minus l of the centres, for the same hyperparameters, and `apart` is the
    root mean square of how far the two posterior means are apart, in standard deviations σ_n of the noise. Both are
    those of all samples if `beside` is `count`, and estimates otherwise. None: they could not be computed in float64.
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
        one, other = Posterior(prior, fewer), Posterior(prior, more)
        try:
            change = other.negative_log_marginal_likelihood()[0] - one.negative_log_marginal_likelihood()[0]
            means = [fewer.stencil.measured(each.signal, fewer.times) for each in (one, other)]
        except IllConditioned:
            return cls(name, count, len(fewer), len(more), None, None)
        apart = float(np.sqrt(np.mean((means[1] - means[0]) ** 2))) / prior.noise_std
        return cls(name, count, len(fewer), len(more), change, apart)

    def __str__(self) -> str:
        said = f"of {self.count} samples of {self.name} by {self.centres} centres"
        if self.change_of_l is None or self.apart is None:
            return f"{said}, at a cost that could not be computed in float64"
        of = "all" if self.beside == self.count else f"{self.beside} centres (an estimate of what all would change)"
        return f"{said}: with {of}, l changes by {self.change_of_l:.2g} and the mean by {self.apart:.2g} of the noise"
