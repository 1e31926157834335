"""Regression on samples seen through a stencil, written out plainly: the process itself at every centre, and a matrix.

y_i = offset + Σ_j w_j g(t_i + j step) + noise_i is y = offset + S g with g the process at all centres, so that the
samples have the covariance S K Sᵀ + diag(noise²).
"""

import math

import numpy as np

from trackably.gp.prior import Prior
from trackably.gp.samples import Samples


def _seen(samples: Samples):
    """All instants that samples look at, one by one, and S."""
    stencil, n = samples.stencil, len(samples)
    centres, S = [], np.zeros((n, n * len(stencil.weights)))
    for i, t in enumerate(samples.times.tolist()):
        for j, w in enumerate(stencil.weights):
            S[i, len(centres)] = w
            centres.append(t + j * stencil.step)
    return np.array(centres), S


def _covariance(prior: Prior, one, other):
    return prior.kernel(np.subtract.outer(one, other))


def _noise(prior: Prior, samples: Samples):
    return np.diag([(prior.noise_std * r) ** 2 for r in samples.relative_noise.tolist()])


def _observed(prior: Prior, samples: Samples):
    centres, S = _seen(samples)
    residual = samples.values - samples.stencil.offset - S @ np.full(len(centres), prior.mean)
    return centres, S, S @ _covariance(prior, centres, centres) @ S.T + _noise(prior, samples), residual


def mean(prior: Prior, samples: Samples, t):
    centres, S, A, residual = _observed(prior, samples)
    return prior.mean + _covariance(prior, t, centres) @ S.T @ np.linalg.inv(A) @ residual


def variance(prior: Prior, samples: Samples, t):
    centres, S, A, _ = _observed(prior, samples)
    cross = _covariance(prior, t, centres) @ S.T
    return np.diag(_covariance(prior, t, t) - cross @ np.linalg.inv(A) @ cross.T)


def negative_log_marginal_likelihood(prior: Prior, samples: Samples) -> float:
    _, _, A, residual = _observed(prior, samples)
    return float(
        math.log(np.linalg.det(A)) + residual @ np.linalg.inv(A) @ residual + len(samples) * math.log(2 * math.pi)
    )
