"""Times of one likelihood with its gradient, of a whole fit without constraints, and of importing the package."""

import warnings
from collections.abc import Callable, Iterator
from functools import partial
from statistics import median
from typing import Any

import numpy as np
from scipy.linalg import lapack

from benchmarks.harness import Row, agree, duel, in_new_process, within
from benchmarks.problems import NOISE, PRIOR, irregular, likelihood, regular, solved
from trackably.gp.factorise import noise_variance
from trackably.gp.factors.dense import Dense
from trackably.gp.posterior import Posterior
from trackably.gp.samples import Samples
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace

_SIZES = (30, 100, 300, 1000, 2000, 3000)
_STRUCTURED = 300  # number of samples from which on the band structure of the covariance matrix is used
_FITS = (30, 100, 300, 1000)
_REGULAR = 2000
_ROUNDS = 9
_MEASURED = "import time; begin = time.process_time(); {}; print(time.process_time() - begin)"

Likelihood = Callable[[], tuple[float, Any]]
"""A function that returns a likelihood with its gradient."""


def rows() -> Iterator[Row]:
    """Yield the rows of all comparisons of this module."""
    for n in _SIZES:
        yield from _likelihoods(n)
    for n in _FITS:
        yield _fit(irregular(n), 5 if n < 1000 else 1)
    samples = regular(_REGULAR)
    own, dense, theirs = partial(likelihood, samples), _dense(samples), scikit_learn(samples)
    check = _same(own, theirs)
    topic, problem = "regular samples: likelihood and gradient", f"n = {_REGULAR}"
    yield duel(topic, problem, "own, whole matrix", own, dense, rounds=3, check=check)
    yield duel(topic, problem, "scikit-learn", own, theirs, rounds=3, target=100.0, check=check)
    numpy = median(_seconds("import numpy"))
    for statement, limit in (("import trackably", 0.05), ("from trackably import learn_reference", 0.4)):
        yield within("import", f"`{statement}`", _seconds(statement), limit, f"numpy alone takes {numpy:.2f} s")


def _likelihoods(n: int) -> Iterator[Row]:
    samples, rounds, topic = irregular(n), 11 if n < 1000 else 3, "likelihood and gradient"
    own, theirs = partial(likelihood, samples), scikit_learn(samples)
    target = 2.0 if n == 300 else 1.5 if n >= 1000 else None
    ways: list[tuple[str, Callable[[], object]]] = [(f"n = {n}", own)]
    if n >= _STRUCTURED:
        ways.append((f"n = {n}, whole matrix", _dense(samples)))
    for problem, ours in ways:
        floor = _floor(samples)
        yield duel(topic, problem, "LAPACK potrf + potri", ours, floor, rounds=rounds, target=target, at_most=True)
    target = 5.0 if n <= 100 else 3.0
    yield duel(topic, f"n = {n}", "scikit-learn", own, theirs, rounds=rounds, target=target, check=_same(own, theirs))


def _same(own: Likelihood, theirs: Likelihood) -> Callable[[], None]:
    return lambda: agree("l", own()[0], -2 * theirs()[0], 1e-9)


def scikit_learn(samples: Samples) -> Likelihood:
    """Return scikit-learn's function for the likelihood with its gradient, at the prior's hyperparameters."""
    regressor = _regressor(optimizer=None).fit(samples.times[:, None], samples.values)
    theta = regressor.kernel_.theta
    return lambda: regressor.log_marginal_likelihood(theta, eval_gradient=True)


def _regressor(bounds: Any = ((1e-20, 1e20), (1e-10, 1e10)), **options: Any) -> Any:
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel

    theta = PRIOR.hyperparameters
    kernel = ConstantKernel(theta["signal_std"] ** 2, bounds[0]) * RBF(theta["lengthscale"], bounds[1])
    return GaussianProcessRegressor(kernel, alpha=NOISE**2, **options)


def _floor(samples: Samples) -> Callable[[], object]:
    difference = samples.times[:, None] - samples.times
    matrix = np.asfortranarray(PRIOR.parts[0].kernel(difference) + NOISE**2 * np.eye(len(samples)))

    def floor() -> object:
        factor, _ = lapack.dpotrf(matrix, lower=True, clean=False)
        return lapack.dpotri(factor, lower=True, overwrite_c=True)

    return floor


def _dense(samples: Samples) -> Callable[[], object]:
    """Return our likelihood without use of any structure of samples and kernel: with a dense covariance matrix."""

    def of_whole_matrix() -> object:
        posterior = Posterior(PRIOR.parts[0], samples)
        covariance, noise = samples.covariance(posterior.prior.kernel), noise_variance(posterior.prior, samples)
        vars(posterior)["_factored"] = Dense.of(*covariance, noise)
        return posterior.negative_log_marginal_likelihood()

    return of_whole_matrix


def _fit(samples: Samples, rounds: int) -> Row:
    space = SearchSpace.around((samples,), PRIOR, starts=1)
    problem, start = ConstrainedProblem((samples,), PRIOR, space), space.start_points()[0]
    bounds = np.exp(np.column_stack([space.log_lower, space.log_upper]) * [[2], [1]])
    ours = partial(solved, problem)

    def theirs() -> Any:
        regressor = _regressor(bounds)
        regressor.kernel.theta = start * [2, 1]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # scikit-learn warns of hyperparameters near their bounds
            return regressor.fit(samples.times[:, None], samples.values)

    return duel(
        "fit without constraints",
        f"n = {len(samples)}, one start",
        "scikit-learn",
        ours,
        theirs,
        rounds=rounds,
        check=lambda: agree("l", ours().objective, -2 * theirs().log_marginal_likelihood_value_, 1e-5),
    )


def _seconds(statement: str) -> list[float]:
    """Return the times [s] of a statement in new interpreters, without the first one, which fills caches."""
    return [float(in_new_process("-c", _MEASURED.format(statement))) for _ in range(_ROUNDS)][1:]
