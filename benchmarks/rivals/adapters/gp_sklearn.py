"""scikit-learn's Gaussian process: hyperparameters of the largest likelihood, no bounds.

What it learns is carried over to the same sum of kernels, so that states and inputs can be read from it. Both have to
agree at the samples.
"""

import warnings
from typing import Any

import numpy as np

from benchmarks.rivals.curves import curve_of
from benchmarks.rivals.model import Answer, Found, Problem, Promise, Rival
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
_PLACES = {"signal_std": "k1__constant_value", "lengthscale": "k2__length_scale", "period": "k2__periodicity"}
_SAME = 1e-3  # of the samples' spread: a sample of a state is half a step beside its flat output


class Disagreement(AssertionError):
    """The same hyperparameters do not give the same mean in both."""


def solve(problem: Problem) -> Answer:
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

    kernel, places = _kernel(prior.kernel, bounds)
    alpha: Any = 1e-10
    if NOISE in bounds:
        low, high = bounds[NOISE]
        kernel = kernel + WhiteKernel(low * high, (low**2, high**2))
        places = {name: f"k1__{place}" for name, place in places.items()} | {NOISE: "k2__noise_level"}
    else:
        alpha = (float(prior.noise_std) * samples.relative_noise) ** 2
    level = samples.stencil.at_rest(prior.mean)
    regressor = GaussianProcessRegressor(kernel, alpha=alpha, n_restarts_optimizer=_RESTARTS, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        regressor.fit(samples.times[:, None], samples.values - level)
    found = regressor.kernel_.get_params()
    values = {name: float(found[place]) for name, place in places.items()}
    squared = {name for name in values if name == NOISE or name.endswith("signal_std")}
    values = {name: value**0.5 if name in squared else value for name, value in values.items()}
    return regressor.predict(samples.times[:, None]) + level, values


def _kernel(kernel: Kernel, bounds: dict[str, Bounds]) -> tuple[Any, dict[str, str]]:
    """Return scikit-learn's kernel, and where it keeps each learned hyperparameter."""
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, ExpSineSquared, Matern

    if isinstance(kernel, Product):
        left, of_left = _kernel(kernel.left, _part("left", bounds))
        right, of_right = _kernel(kernel.right, _part("right", bounds))
        places = {f"left.{name}": f"k1__{place}" for name, place in of_left.items()}
        return left * right, places | {f"right.{name}": f"k2__{place}" for name, place in of_right.items()}
    given = kernel.hyperparameters

    def value(name: str) -> tuple[float, Any]:
        if name not in bounds:
            return float(given[name]), "fixed"
        return float(np.sqrt(bounds[name][0] * bounds[name][1])), bounds[name]

    std, range_ = value("signal_std")
    amplitude = ConstantKernel(std**2, range_ if range_ == "fixed" else (range_[0] ** 2, range_[1] ** 2))
    length, lengths = value("lengthscale")
    match kernel:
        case SquaredExponential():
            shape: Any = RBF(length, lengths)
        case Matern52():
            shape = Matern(length, lengths, nu=2.5)
        case Periodic():
            period, periods = value("period")
            shape = ExpSineSquared(length, period, lengths, periods)
        case _:
            raise NotImplementedError(type(kernel).__name__)
    return amplitude * shape, {name: place for name, place in _PLACES.items() if name in bounds}


def _part(side: str, bounds: dict[str, Bounds]) -> dict[str, Bounds]:
    return {name.removeprefix(f"{side}."): b for name, b in bounds.items() if name.startswith(f"{side}.")}


SKLEARN = Rival(
    "a",
    "scikit-learn GaussianProcessRegressor",
    Promise(
        "The prediction is probabilistic (Gaussian) so that one can compute empirical confidence intervals",
        "scikit-learn, User Guide 1.7",
        "no bounds",
    ),
    solve,
    needs=("sklearn",),
    licence="BSD-3-Clause",
)
