"""Gaussian process regression written out plainly: the process at every instant, a matrix, and its inverse.

A sample y_i = o + Σ_j w_j g(t_i + j step) + noise_i is y = o + S g + noise with g the process at all instants, so that
the samples have the covariance S K Sᵀ + diag(noise²).
"""

import math

import numpy as np

from trackably.gp.joint import JointPrior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencils


def _covariance(prior: Prior, one, other):
    return prior.kernel(np.subtract.outer(np.asarray(one), np.asarray(other)))


def _observed(prior: Prior, samples: Samples):
    """Return all instants, one by one; S; the inverse covariance of y, its log-determinant; and y − o − S m."""
    of = samples.stencil
    kinds = [of.parts[kind] for kind in of.of] if isinstance(of, Stencils) else [of] * len(samples)
    instants, S = [], np.zeros((len(samples), sum(len(kind.weights) for kind in kinds)))
    for i, (t, kind) in enumerate(zip(samples.times.tolist(), kinds, strict=True)):
        for j, w in enumerate(kind.weights):
            S[i, len(instants)] = w
            instants.append(t + j * kind.step)
    noise = np.diag((prior.noise_std * samples.relative_noise) ** 2)
    A = S @ _covariance(prior, instants, instants) @ S.T + noise
    residual = samples.values - np.array([kind.offset for kind in kinds]) - S @ np.full(len(instants), prior.mean)
    return instants, S, np.linalg.inv(A), np.linalg.slogdet(A)[1], residual


def mean(prior: Prior, samples: Samples, t):
    instants, S, inverse, _, residual = _observed(prior, samples)
    return prior.mean + _covariance(prior, t, instants) @ S.T @ inverse @ residual


def covariance(prior: Prior, samples: Samples, t):
    instants, S, inverse, *_ = _observed(prior, samples)
    cross = _covariance(prior, t, instants) @ S.T
    return _covariance(prior, t, t) - cross @ inverse @ cross.T


def negative_log_marginal_likelihood(prior: Prior, samples: Samples) -> float:
    _, _, inverse, log_determinant, residual = _observed(prior, samples)
    return float(log_determinant + residual @ inverse @ residual + len(samples) * math.log(2 * math.pi))


def by_log_hyperparameters(f, prior: Prior | JointPrior):
    """∂f(prior)/∂ln θ of the learned hyperparameters by central differences: one row for each."""
    if isinstance(prior, Prior):
        return by_log_hyperparameters(lambda joint: f(joint.parts[0]), JointPrior((prior,)))
    theta, step = prior.log_hyperparameters, 1e-5
    rows = []
    for direction in np.eye(theta.size):
        up, down = (prior.with_log_hyperparameters(theta + s * step * direction) for s in (1, -1))
        rows.append((np.asarray(f(up)) - np.asarray(f(down))) / (2 * step))
    return np.array(rows)
