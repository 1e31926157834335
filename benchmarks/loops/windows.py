"""What a loop waits for: windows that are learned and proved again."""

from collections.abc import Callable, Iterator
from time import process_time

import numpy as np

from benchmarks.duel import Row
from pipeline.published.scalar import scalar
from trackably.arrays import Array
from trackably.certificates.certified import Certified, learn_certified
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.learner import JOINT
from trackably.learning.space import SearchSpace
from trackably.streams.relearner import WindowLearner
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Interval, Polytope

_TOPIC = "windows learned again"
_WINDOWS, _COUNT = 100, 30
_WARM, _LATEST = 0.010, 0.020  # seconds


def rows() -> Iterator[Row]:
    """Windows of two systems."""
    narrow = scalar(0.9, 0.5, state_set=Interval(-2.0, 0.05), input_set=Interval(-0.5, 0.5), sampling_time=0.01)
    yield from _windows("Example 1's system", narrow, 0.1, lambda t: -0.6 + 0.55 * np.sin(np.pi * t / 2))
    moved = integrator(1.0, 1.4, 2.0)
    yield from _windows("double integrator", moved, 0.2, lambda t: np.sin(2 * np.pi * t / 4.5))


def integrator(position: float, velocity: float, acceleration: float, step: float = 0.1) -> ConstrainedSystem:
    """Return a double integrator whose state and input are bounded by these sizes."""
    system = LinearSystem(np.array([[1.0, step], [0.0, 1.0]]), np.array([[step**2 / 2], [step]]), sampling_time=step)
    states, inputs = [position, velocity], [acceleration]
    return ConstrainedSystem(
        system, Polytope.box([-v for v in states], states), Polytope.box([-v for v in inputs], inputs)
    )


def _windows(name: str, plant: ConstrainedSystem, step: float, truth: Callable[[Array], Array]) -> Iterator[Row]:
    """Each window is one sample later than the one before it; the hyperparameters are those of the first."""
    times = step * np.arange(_COUNT + _WINDOWS)
    values = truth(times) + 0.02 * np.random.default_rng(0).standard_normal(times.size)
    windows = [(Samples(times[i : i + _COUNT], values[i : i + _COUNT]),) for i in range(_WINDOWS)]
    prior = JointPrior((Prior(SquaredExponential()),))
    first = learn_certified(windows[0], prior, plant, SearchSpace.around(windows[0], prior, starts=2), learner=JOINT)
    assert isinstance(first, Certified), first.explanation
    for moving_every, what in ((0, "function alone"), (1, "hyperparameters too")):
        learner = WindowLearner(first, clock=process_time, moving_every=moving_every)
        certified = sum(isinstance(learner(samples), Certified) for samples in windows[1:])
        note = f"{what}, {certified} of {_WINDOWS - 1} windows certified"
        yield from _statistics(f"{name}, n = {_COUNT}, {what}", np.array(learner.seconds[1:]), note, not moving_every)


def _statistics(name: str, seconds: Array, note: str, is_wanted: bool) -> Iterator[Row]:
    """Yield median and 99th percentile beside the budgets, which are targets where that `is_wanted`."""
    for what, found, budget in (
        ("median", float(np.median(seconds)), _WARM),
        ("99th percentile", float(np.quantile(seconds, 0.99)), _LATEST),
    ):
        part, target = found / budget, 1.0 if is_wanted else None
        numbers = found, budget, *(part,) * 3
        yield Row(_TOPIC, f"{name}, {what}", f"{budget * 1e3:g} ms", *numbers, target, at_most=True, note=note)
