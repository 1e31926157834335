"""One likelihood with its gradient, and a whole fit without constraints."""

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from scipy.linalg import lapack

from benchmarks.duel import Row, agree, duel
from benchmarks.problems import NOISE, PRIOR, free, irregular, likelihood, regular
from trackably.gp.factorise import unstructured
from trackably.gp.posterior import Posterior
from trackably.gp.samples import Samples
from trackably.learning.problem import Solution
from trackably.learning.search import best_solution

_SIZES = (30, 100, 300, 1000, 2000, 3000)
_STRUCTURED = 300  # samples, from which on the covariance matrix is taken for the band that it is
_FITS = (30, 100, 300, 1000)


def rows() -> Iterator[Row]:
    """All comparisons."""
    for n in _SIZES:
        samples, rounds = irregular(n), 11 if n < 1000 else 3
        own = lambda samples=samples: likelihood(samples)  # noqa: E731
        for problem, ours in ((f"n = {n}", own), (f"n = {n}, whole matrix", _dense(samples))):
            if n >= _STRUCTURED or ours is own:
                yield duel(
                    "likelihood and gradient",
                    problem,
                    "LAPACK potrf + potri",
                    ours,
                    _floor(samples),
                    rounds=rounds,
                    target=2.0 if n == 300 else 1.5 if n >= 1000 else None,
                    at_most=True,
                )
        theirs = scikit_learn(samples)
        yield duel(
            "likelihood and gradient",
            f"n = {n}",
            "scikit-learn",
            lambda samples=samples: likelihood(samples),
            theirs,
            rounds=rounds,
            target=5.0 if n <= 100 else 3.0,
            check=lambda samples=samples, theirs=theirs: agree("l", likelihood(samples)[0], -2 * theirs()[0], 1e-9),
        )
    for n in _FITS:
        yield _fit(irregular(n), 5 if n < 1000 else 1)
    yield from _regular(2000)


def scikit_learn(samples: Samples) -> Callable[[], tuple[float, Any]]:
    """Its likelihood with gradient, at the prior's hyperparameters."""
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
    """The likelihood as for samples and kernels without any structure: what is always possible."""

    def of_whole_matrix() -> object:
        posterior = Posterior(PRIOR.parts[0], samples)
        covariance = samples.stencil.covariance(posterior.prior.kernel)
        vars(posterior)["_factored"] = unstructured(posterior.prior, samples, covariance)
        return posterior.negative_log_marginal_likelihood()

    return of_whole_matrix


def _fit(samples: Samples, rounds: int) -> Row:
    problem = free(samples)
    space = problem.space
    start = space.start_points()[0]
    bounds = np.exp(np.column_stack([space.log_lower, space.log_upper]) * [[2], [1]])

    def ours() -> Solution:
        found = best_solution(problem)
        assert isinstance(found, Solution)
        return found

    def theirs() -> Any:
        regressor = _regressor(bounds)
        regressor.kernel.theta = start * [2, 1]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of bounds nearly met
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


def _regular(n: int) -> Iterator[Row]:
    samples = regular(n)
    theirs = scikit_learn(samples)
    for rival, function, target in (("own, whole matrix", _dense(samples), None), ("scikit-learn", theirs, 100.0)):
        yield duel(
            "regular samples: likelihood and gradient",
            f"n = {n}",
            rival,
            lambda: likelihood(samples),
            function,
            rounds=3,
            target=target,
            check=lambda: agree("l", likelihood(samples)[0], -2 * theirs()[0], 1e-9),
        )
