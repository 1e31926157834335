"""Constrained learning by brute force: every constraint at every step, gradients by finite differences."""

import math
import warnings

import numpy as np
from scipy.optimize import minimize

from pipeline.published.scalar import coefficients, interval_sets
from tests.trackably.learning.instances import Instance
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples

NOWHERE = 1e12


def objective(prior: Prior, samples: Samples) -> float:
    gram = prior.kernel(samples.times[:, None] - samples.times) + prior.noise_std**2 * np.eye(len(samples))
    sign, log_determinant = np.linalg.slogdet(gram)
    residual = samples.values - prior.mean
    value = log_determinant + residual @ np.linalg.inv(gram) @ residual + len(samples) * math.log(2 * math.pi)
    return float(value) if sign > 0 and np.isfinite(value) else NOWHERE


def states_and_inputs(instance: Instance, prior: Prior) -> tuple[np.ndarray, np.ndarray]:
    """The mean at all constrained steps, and the inputs between them."""
    samples, plant = instance.samples, instance.plant
    gram = prior.kernel(samples.times[:, None] - samples.times) + prior.noise_std**2 * np.eye(len(samples))
    t = np.arange(instance.last + 1) * plant.sampling_time
    cross = prior.kernel(t[:, None] - samples.times)
    x = prior.mean + cross @ np.linalg.inv(gram) @ (samples.values - prior.mean)
    a, b, c = coefficients(plant)
    return x, (x[1:] - a * x[:-1] - c) / b


def margins(instance: Instance, prior: Prior) -> np.ndarray:
    """Distances to all bounds, as parts of their widths."""
    x, u = states_and_inputs(instance, prior)
    X, U = interval_sets(instance.plant)
    parts = [(x - X.lower) / X.width, (X.upper - x) / X.width, (u - U.lower) / U.width, (U.upper - u) / U.width]
    return np.concatenate(parts)


def best_on_a_grid(instance: Instance, points: int = 30, zooms: int = 3) -> float:
    """The smallest objective among feasible points of a grid over the search space, refined around its best."""
    space = instance.problem.space
    low, high = space.log_lower, space.log_upper
    best, at = math.inf, (low + high) / 2
    for _ in range(zooms):
        for one in np.linspace(low[0], high[0], points):
            for two in np.linspace(low[1], high[1], points):
                prior = instance.prior.with_log_hyperparameters(np.array([one, two]))
                value = objective(prior, instance.samples)
                if value < best and np.all(margins(instance, prior) >= 0):
                    best, at = value, np.array([one, two])
        around = 2 * (high - low) / points
        low, high = np.maximum(space.log_lower, at - around), np.minimum(space.log_upper, at + around)
        points = 12
    return best


def best_of_many_starts(instance: Instance, starts: int = 8) -> float:
    """The smallest objective among feasible results of SLSQP, from random starts, without any gradient."""
    space, prior = instance.problem.space, instance.prior
    rng = np.random.default_rng(0)

    def at(log_theta):
        return prior.with_log_hyperparameters(np.clip(log_theta, space.log_lower, space.log_upper))

    best = math.inf
    for _ in range(starts):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # what it meets on its way is its own business
            result = minimize(
                lambda z: objective(at(z), instance.samples),
                space.log_lower + rng.uniform(0.2, 0.8, len(space.log_lower)) * (space.log_upper - space.log_lower),
                method="SLSQP",
                bounds=list(zip(space.log_lower, space.log_upper, strict=True)),
                constraints=[{"type": "ineq", "fun": lambda z: margins(instance, at(z))}],
                options={"ftol": 1e-12, "maxiter": 300},
            )
        found = at(result.x)
        if np.all(margins(instance, found) >= -1e-9):
            best = min(best, objective(found, instance.samples))
    return best
