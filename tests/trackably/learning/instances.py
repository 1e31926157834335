"""Random learning problems whose prior mean is an admissible equilibrium, small enough to be solved by brute force."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipeline.published.scalar import scalar, state_and_input
from tests.trackably.systems.instances import bounded
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import Steps
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval

_KERNELS: tuple[Kernel, ...] = (
    SquaredExponential(1.0, 1.0),
    Matern52(1.0, 1.0),
    RationalQuadratic(1.0, 1.0, 1.5),
    Matern32(1.0, 1.0),
)


@dataclass(frozen=True)
class Instance:
    """Samples, prior and plant, with states constrained at steps 0 … last and inputs up to the step before."""

    samples: Samples
    prior: Prior
    plant: ConstrainedSystem
    last: int

    @property
    def problem(self) -> ConstrainedProblem:
        t_s, (state, entry) = self.plant.sampling_time, state_and_input(self.plant)
        prior = JointPrior((self.prior,))
        return ConstrainedProblem(
            (self.samples,),
            prior,
            SearchSpace.around((self.samples,), prior),
            (
                Constraint(state, Steps(0, self.last, t_s)),
                Constraint(entry, Steps(0, self.last - 1, t_s)),
            ),
        )

    def smallest_margin(self, found: Any) -> float:
        """Of all constraints at all of their steps, as a part of the widths of their bounds."""
        sets = [(c.quantity, np.arange(c.index_set.first, c.index_set.last + 1)) for c in self.problem.constraints]
        t_s = self.plant.sampling_time
        return min(float(np.min(q.margin(found.signals, k * t_s))) / q.bounds.width for q, k in sets)


def tight(seed: int) -> Instance:
    """A fading oscillation, sampled with noise, that the sets allow to follow badly only: many local minima."""
    rng = np.random.default_rng(seed)
    times = np.sort(rng.choice(51, size=int(rng.integers(7, 12)), replace=False)) * 0.02
    clean = rng.uniform(0.7, 1.2) * np.cos(rng.uniform(4, 8) * times) * np.exp(-2 * times)
    samples = Samples(times, clean + 0.03 * rng.standard_normal(times.size))
    kernel = _KERNELS[seed % len(_KERNELS)]
    a, b = [(0.9, 0.5), (0.95, -0.3), (1.05, 0.4), (1.0, -0.25), (-0.2, 1.5)][seed % 5]
    reach = rng.uniform(0.3, 0.7) if seed % 5 == 4 else rng.uniform(0.1, 0.4)
    states, inputs = Interval(-rng.uniform(0.1, 0.3), 1.2), Interval(-reach, 1.2 * reach)
    plant = scalar(a, b, state_set=states, input_set=inputs, sampling_time=0.02)
    learned = Prior(kernel.as_learned(kernel.hyperparameters.keys() - {"shape"}), 0.03)
    return Instance(samples, learned, plant, 100)


def instance(seed: int) -> Instance:
    """The same, in sets that hold most of what a plain fit (amplitude 1, length scale 0.3 s) does."""
    case = tight(seed)
    plain = Posterior(case.prior.with_hyperparameters({"signal_std": 1.0, "lengthscale": 0.3}), case.samples)
    times = np.arange(case.last + 1) * case.plant.sampling_time

    def most_of(values: np.ndarray) -> Interval:
        return Interval(0.9 * min(float(np.min(values)), -0.02), 0.9 * max(float(np.max(values)), 0.02))

    states, inputs = (most_of(quantity((plain.signal,), times)) for quantity in state_and_input(case.plant))
    return replace(case, plant=bounded(case.plant, state_set=states, input_set=inputs))


def wild(seed: int) -> Instance:
    """An admissible equilibrium at the prior mean, and samples that have nothing to do with the sets."""
    rng = np.random.default_rng(1000 + seed)
    base = tight(seed)
    times = np.sort(rng.uniform(0, 2, 12))
    values = 10.0 ** (seed % 6) * rng.standard_normal(12)
    return replace(base, samples=Samples(times, values))


TIGHT_SEEDS = (0, 3, 4, 6, 8, 9)
