"""Gaussian process regression written out plainly: loops, an explicit inverse, a determinant."""

import math

import numpy as np

from trackably.gp.prior import Prior
from trackably.gp.samples import Samples


def _covariance(prior: Prior, one, other):
    return np.array([[float(prior.kernel(np.array(s - t))) for t in other] for s in one])


def _inverse(prior: Prior, samples: Samples):
    noise = prior.noise_std**2 * np.eye(len(samples))
    return np.linalg.inv(_covariance(prior, samples.times, samples.times) + noise)


def mean(prior: Prior, samples: Samples, t):
    cross = _covariance(prior, t, samples.times)
    return prior.mean + cross @ _inverse(prior, samples) @ (samples.values - prior.mean)


def variance(prior: Prior, samples: Samples, t):
    cross = _covariance(prior, t, samples.times)
    return np.diag(_covariance(prior, t, t) - cross @ _inverse(prior, samples) @ cross.T)


def negative_log_marginal_likelihood(prior: Prior, samples: Samples) -> float:
    inverse, residual = _inverse(prior, samples), samples.values - prior.mean
    log_determinant = -np.linalg.slogdet(inverse)[1]
    return float(log_determinant + residual @ inverse @ residual + len(samples) * math.log(2 * math.pi))


def by_log_hyperparameters(f, prior: Prior, step: float = 1e-5):
    """∂f(prior)/∂ln θ of the learned hyperparameters by central differences: one row for each."""
    theta = prior.log_hyperparameters
    rows = []
    for direction in np.eye(theta.size):
        up, down = (prior.with_log_hyperparameters(theta + s * step * direction) for s in (1, -1))
        rows.append((np.asarray(f(up)) - np.asarray(f(down))) / (2 * step))
    return np.array(rows)
