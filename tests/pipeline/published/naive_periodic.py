"""The exact form of the periodic problem a second time: formulas written out, without anything of the library."""

import math

import numpy as np

from pipeline.published.scalar import coefficients, interval_sets
from tests.pipeline.published.periodic_instances import Instance


class Brute:
    def __init__(self, case: Instance) -> None:
        (self.samples,), (self.prior,), self.plant = case.samples, case.prior.parts, case.plant
        self.y = self.samples.values - self.prior.mean

    def kernel(self, z: np.ndarray, r: np.ndarray) -> np.ndarray:
        std, length, period = np.exp(z)
        return std**2 * np.exp(-2 / length**2 * np.sin(math.pi * r / period) ** 2)

    def gram(self, z: np.ndarray) -> np.ndarray:
        t = self.samples.times
        return self.kernel(z, t[:, None] - t) + self.prior.noise_std**2 * np.eye(len(t))

    def objective(self, z: np.ndarray) -> float:
        gram = self.gram(z)
        _, log_determinant = np.linalg.slogdet(gram)
        return float(log_determinant + self.y @ np.linalg.solve(gram, self.y) + len(self.y) * math.log(2 * math.pi))

    def margins(self, z: np.ndarray, phases: np.ndarray) -> np.ndarray:
        """Distances to all four bounds, as parts of their widths, at phases in [0, 1) of the period: shape (4, n)."""
        plant, weights = self.plant, np.linalg.solve(self.gram(z), self.y)
        t = phases * math.exp(z[2])

        def mean(at: np.ndarray) -> np.ndarray:
            return self.prior.mean + self.kernel(z, at[:, None] - self.samples.times) @ weights

        x, successor = mean(t), mean(t + plant.sampling_time)
        (a, b, c), (X, U) = coefficients(plant), interval_sets(plant)
        u = (successor - a * x - c) / b
        parts = [(x - X.lower) / X.width, (X.upper - x) / X.width, (u - U.lower) / U.width, (U.upper - u) / U.width]
        return np.array(parts)
