"""Ten periodic learning problems: random samples, systems and sets, the latter cutting into what a plain fit does."""

from dataclasses import dataclass

import numpy as np

from pipeline.published.scalar import scalar
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval

_SYSTEMS = ((0.9, 0.1), (0.95, -0.3), (1.05, 0.4), (1.0, -0.25), (-0.2, 1.5))
SEEDS = range(10)


@dataclass(frozen=True)
class Instance:
    samples: tuple[Samples]
    prior: JointPrior
    plant: ConstrainedSystem
    space: SearchSpace


def instance(seed: int) -> Instance:
    """Two harmonics, seen once or twice, in sets between 0.6 and 1.2 times what a plain fit needs."""
    rng = np.random.default_rng(seed)
    count, period = int(rng.integers(8, 15)), rng.uniform(1.5, 3.0)
    span = rng.uniform(1.1, 2.2) * period
    times = np.sort(rng.uniform(0, span, count)) if seed % 2 else np.linspace(0, span, count)
    first, second = (np.sin(n * 2 * np.pi / period * times + rng.uniform(0, 6)) for n in (1, 2))
    clean = rng.uniform(0.5, 2) * (first + rng.uniform(0, 0.7) * second)
    samples = Samples(times, clean + rng.uniform(0.02, 0.3) * rng.standard_normal(count))
    prior = Prior(Periodic(1.0, Learned(1.0, (0.2, 10.0)), period).as_learned(), float(rng.uniform(0.05, 0.2)))
    (a, b), sampling_time = _SYSTEMS[seed % 5], float(rng.choice([0.01, 0.05, 0.1]))
    theta = {"signal_std": float(np.std(samples.values)), "lengthscale": 0.8, "period": period}
    plain, phases = Posterior(prior.with_hyperparameters(theta), samples).signal, np.linspace(0, period, 400)

    def part_of(values: np.ndarray, part: float) -> Interval:
        return Interval(part * min(float(np.min(values)), -0.02), part * max(float(np.max(values)), 0.02))

    x, successor = plain(phases), plain(phases + sampling_time)
    X, U = (part_of(values, rng.uniform(0.6, 1.2)) for values in (x, (successor - a * x) / b))
    plant = scalar(a, b, state_set=X, input_set=U, sampling_time=sampling_time)
    joint = JointPrior((prior,))
    return Instance((samples,), joint, plant, SearchSpace.around((samples,), joint, starts=24))
