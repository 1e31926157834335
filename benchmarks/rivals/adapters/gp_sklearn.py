"""scikit-learn's Gaussian process: hyperparameters of the largest likelihood, no bounds.

What it learns is carried over to the same sum of kernels, so that states and inputs can be read from it. Both have to
agree at the samples.
"""

import warnings
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from benchmarks.harness import Disagreement
from benchmarks.rivals.curves import curve_of
from benchmarks.rivals.model import Found, Problem
from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.kernels.base import Kernel, Product
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import NOISE, Prior
from trackably.gp.samples import Samples
from trackably.learning.space import SearchSpace

Bounds = tuple[float, float]

_RESTARTS = 8
_WIDE = 1e8
_SAME = 1e-3  # of the samples' spread: a sample of a state is half a step beside its flat output


def solve(problem: Problem) -> Found:
    """Fit each flat output by its own GaussianProcessRegressor."""
    task = problem.task
    learned: dict[str, float] = {}
    means = []
    for process, prior, samples in zip(task.prior.names, task.prior.parts, task.samples, strict=True):
        called = {name: task.prior.name_of(process, name) for name in prior.learned}
        bounds = {name: _sought(task.space, full) for name, full in called.items()}
        mean, values = _fitted(prior, bounds, samples)
        learned.update({called[name]: value for name, value in values.items()})
        means.append(mean)
    theta = np.log([learned[name] for name in task.prior.learned])
    posterior = JointPosterior(task.prior.with_log_hyperparameters(theta), task.samples)
    curve = curve_of(posterior.signals, problem)
    for i, (mean, samples) in enumerate(zip(means, task.samples, strict=True)):
        apart = float(np.max(np.abs(curve.sampled(i, samples.times) - mean)))
        if apart > _SAME * float(np.ptp(samples.values)):
            raise Disagreement(f"{problem.name}: means differ by {apart:g}")
    objective = posterior.negative_log_marginal_likelihood()[0]
    return Found(curve, objective, "l(θ)", prior=posterior.prior)


def _sought(space: SearchSpace, name: str) -> Bounds:
    """Return where our own searches start, or where they may go if that is known better."""
    interval = space.sought.get(name, space.bounds[name])
    low, high = interval.lower, interval.upper
    if high / low > _WIDE:  # the middle half, of logarithms
        low, high = low**0.75 * high**0.25, low**0.25 * high**0.75
    return low, high


def _fitted(prior: Prior, bounds: dict[str, Bounds], samples: Samples) -> tuple[Array, dict[str, float]]:
    """Return the mean at the samples, and the learned hyperparameters by our names."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import WhiteKernel

    given = prior.kernel.hyperparameters
    kernel = _kernel(prior.kernel, lambda name: _start(name, float(given[name]), bounds))
    kernel = kernel + WhiteKernel(*_squared(*_start(NOISE, float(prior.noise_std), bounds)))
    level = samples.stencil.at_rest(prior.mean)
    regressor = GaussianProcessRegressor(kernel, n_restarts_optimizer=_RESTARTS, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        regressor.fit(samples.times[:, None], samples.values - level)
    # Both have what is learned in the same order; theirs are logarithms, of squares where ours are deviations.
    names = [name for name in (*given, NOISE) if name in bounds]
    halves = [0.5 if name == NOISE or name.endswith("signal_std") else 1.0 for name in names]
    values = np.exp(regressor.kernel_.theta * halves).tolist()
    return regressor.predict(samples.times[:, None]) + level, dict(zip(names, values, strict=True))


Start = tuple[float, Bounds | Literal["fixed"]]
"""Where a hyperparameter is sought first, and in which interval."""


def _start(name: str, given: float, bounds: dict[str, Bounds]) -> Start:
    return (float(np.sqrt(np.prod(bounds[name]))), bounds[name]) if name in bounds else (given, "fixed")


def _squared(value: float, bounds: Bounds | Literal["fixed"]) -> Start:
    return value**2, bounds if bounds == "fixed" else (bounds[0] ** 2, bounds[1] ** 2)


def _kernel(kernel: Kernel, start: Callable[[str], Start]) -> Any:
    """Return scikit-learn's kernel."""
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, ExpSineSquared, Matern

    if isinstance(kernel, Product):
        left, right = kernel.left, kernel.right
        return _kernel(left, lambda name: start(f"left.{name}")) * _kernel(right, lambda name: start(f"right.{name}"))
    length, lengths = start("lengthscale")
    match kernel:
        case SquaredExponential():
            shape: Any = RBF(length, lengths)
        case Matern52():
            shape = Matern(length, lengths, nu=2.5)
        case Periodic():
            period, periods = start("period")
            shape = ExpSineSquared(length, period, lengths, periods)
        case _:
            raise NotImplementedError(type(kernel).__name__)
    return ConstantKernel(*_squared(*start("signal_std"))) * shape
