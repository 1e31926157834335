"""The exact form of the periodic problem by brute force: formulas written out, dense phases, random starts.

Run as `python -m tests.pipeline.published.naive_periodic` it prints the table that test_periodic_random.py
compares with; this takes minutes. Of the library it uses the local optimiser only: neither kernels, exchange, screening
nor starts.
"""

import math

import numpy as np
from scipy.optimize import minimize_scalar

from pipeline.published.scalar import coefficients, interval_sets
from tests.pipeline.published.periodic_instances import SEEDS, Instance, instance
from trackably.learning import sqp

NOWHERE = 1e9
COARSE, FINE = 100, 6000
STARTS, POLISHED = 120, 8


class Brute:
    def __init__(self, case: Instance) -> None:
        (self.samples,), (self.prior,), self.plant = case.samples, case.prior.parts, case.plant
        self.y = self.samples.values - self.prior.mean
        self.low, self.high = case.space.log_lower, case.space.log_upper

    def kernel(self, z: np.ndarray, r: np.ndarray) -> np.ndarray:
        std, length, period = np.exp(z)
        return std**2 * np.exp(-2 / length**2 * np.sin(math.pi * r / period) ** 2)

    def gram(self, z: np.ndarray) -> np.ndarray:
        t = self.samples.times
        return self.kernel(z, t[:, None] - t) + self.prior.noise_std**2 * np.eye(len(t))

    def objective(self, z: np.ndarray) -> float:
        gram = self.gram(z)
        sign, log_determinant = np.linalg.slogdet(gram)
        if sign <= 0:
            return NOWHERE
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

    def touching(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Phases at which one of the four margins is locally smallest and small, and that margin; found one by one."""
        margins = self.margins(z, np.arange(FINE) / FINE)
        dips = (margins < np.roll(margins, 1, axis=1)) & (margins <= np.roll(margins, -1, axis=1)) & (margins < 0.05)
        phases, values = [], []
        for bound, i in zip(*np.nonzero(dips), strict=True):
            found = minimize_scalar(
                lambda phase, bound=bound: self.margins(z, np.array([phase]))[bound, 0],
                bounds=((i - 1) / FINE, (i + 1) / FINE),
                method="bounded",
                options={"xatol": 1e-10},
            )
            phases.append(found.x)
            values.append(found.fun)
        return np.array(phases), np.array(values)

    def descend(self, z: np.ndarray, phases: np.ndarray) -> np.ndarray:
        """A local minimum with all bounds at the phases (n,); derivatives by central differences."""

        def at(w: np.ndarray) -> np.ndarray:
            return np.append(self.objective(w), self.margins(w, phases).ravel())

        def evaluate(w: np.ndarray) -> sqp.Evaluation | None:
            here = at(w)
            if here[0] >= NOWHERE:
                return None
            slopes = np.array([(at(w + h) - at(w - h)) / 2e-6 for h in 1e-6 * np.eye(3)])
            return sqp.Evaluation(float(here[0]), slopes[:, 0], here[1:], slopes[:, 1:].T)

        found = sqp.minimise(evaluate, z, self.low, self.high)
        return z if found is None else found.x

    def polished(self, z: np.ndarray) -> tuple[float, np.ndarray]:
        """Smallest margin and ln θ after some rounds with constraints exactly where margins are smallest."""
        phases = np.empty(0)
        for _ in range(15):
            new, margins = self.touching(z)
            if np.min(margins, initial=0.0) > -1e-10 and len(phases):
                break
            phases = np.concatenate([phases, new])
            if not len(phases):
                break
            z = self.descend(z, phases)
        return float(np.min(self.touching(z)[1], initial=1.0)), z

    def best(self) -> float:
        """The smallest objective among polished results that keep every bound at the fine phases."""
        rng, coarse = np.random.default_rng(1), np.arange(COARSE) / COARSE
        starts = rng.uniform(self.low, self.high, (STARTS, 3))
        starts[:, 0] = np.log(np.std(self.y)) + rng.uniform(-3, 1, STARTS)
        ends = [self.descend(z, coarse) for z in starts]
        feasible = [z for z in ends if np.min(self.margins(z, coarse)) > -1e-4]
        ranked = sorted(feasible, key=self.objective)[: 4 * POLISHED]
        distinct: list[np.ndarray] = []
        for z in ranked:
            if all(np.max(np.abs(z - other)) > 1e-3 for other in distinct) and len(distinct) < POLISHED:
                distinct.append(z)
        final = [self.polished(z) for z in distinct]
        return min((self.objective(z) for margin, z in final if margin >= -1e-9), default=math.inf)


if __name__ == "__main__":
    print("seed,objective")
    for seed in SEEDS:
        print(f"{seed},{Brute(instance(seed)).best()!r}", flush=True)
