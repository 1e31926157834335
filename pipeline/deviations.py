"""Posterior standard deviations of states, as logs and figures show them."""

from functools import partial

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.posterior import Posterior
from trackably.gp.signal import in_blocks
from trackably.systems.trajectories import Functional


def deviation(posterior: JointPosterior, functional: Functional, times: Array) -> Array:
    """Return the posterior standard deviation of a functional at `times` [s]; an array of the same shape as `times`."""
    step = functional.sampling_time
    own = (variance(posterior.parts[c], weights, step, times) for c, weights in functional.rounded)
    return np.asarray(np.sqrt(sum(own, np.zeros(times.shape))))


def variance(posterior: Posterior, weights: Array, step: float, t: Array) -> Array:
    """Return the variance of Σ_j w_j g(t + j step) at t [s], for `weights` w (J,) and a step [s]; same shape as t.

    For a single weight of 1 it is κ(0) − k(t)ᵀ (K + σ_n² I)⁻¹ k(t), where k(t) are the covariances of the signal at
    t and the samples. It is at least 0.
    """
    width = 4 * len(weights) * len(posterior.samples.centres)
    return in_blocks(partial(_variance, posterior, weights, step), np.asarray(t, dtype=float), width)


def _variance(posterior: Posterior, weights: Array, step: float, t: Array) -> Array:
    kernel, samples = posterior.prior.kernel, posterior.samples
    shifts = step * np.arange(len(weights))
    cross = samples.stencil.combine(weights @ kernel(t[..., None, None] + shifts[:, None] - samples.centres))
    columns = cross.reshape(-1, len(samples)).T
    explained = np.sum(cross * posterior.solve(columns).T.reshape(cross.shape), axis=-1)
    before = weights @ kernel(shifts[:, None] - shifts) @ weights
    return np.asarray(np.maximum(before - explained, 0.0))
