"""What it costs to learn from fewer samples than there are."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from trackable.arrays import Array
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

        def judged(samples: Samples) -> tuple[float, Array]:
            """Return l, and the posterior mean as `fewer` would measure it; the large matrices are not kept."""
            posterior = Posterior(prior, samples)
            return posterior.negative_log_likelihood, fewer.stencil.measured(posterior.signal, fewer.times)

        try:
            (l_one, one), (l_other, other) = judged(fewer), judged(more)
        except IllConditioned:
            return cls(name, count, len(fewer), len(more), None, None)
        apart = float(np.sqrt(np.mean((other - one) ** 2))) / prior.noise_std
        return cls(name, count, len(fewer), len(more), l_other - l_one, apart)

    def __str__(self) -> str:
        said = f"of {self.count} samples of {self.name} by {self.centres} centres"
        if self.change_of_l is None or self.apart is None:
            return f"{said}, at a cost that could not be computed in float64"
        of = "all" if self.beside == self.count else f"{self.beside} centres (an estimate of what all would change)"
        return f"{said}: with {of}, l changes by {self.change_of_l:.2g} and the mean by {self.apart:.2g} of the noise"
