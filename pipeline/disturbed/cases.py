"""Plants with disturbances: the experiments' and random ones, with references that are proved for them."""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import numpy as np

from pipeline.experiments import load_experiments
from pipeline.methods import JOINT, ROBUST
from pipeline.storage.archive import read_fit
from pipeline.storage.results import Results
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove_on_window
from trackably.control.controller import Controller, scaled_controller, shortest_horizon
from trackably.control.tube import TubeController
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbance.tightening import Tightening, tightening
from trackably.systems.disturbance.zonotope import Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.reference import Reference
from trackably.systems.sets.polytope import Polytope

_HORIZON, _PART = 15, 0.95


@dataclass(frozen=True, eq=False)
class Case:
    """A plant whose bounds are drawn in, the reference proved for it, and the one that is proved without disturbance.

    Both are proved for the first `steps` steps at least.
    """

    name: str
    tightening: Tightening
    robust: Reference
    nominal: Reference
    horizon: int
    steps: int

    @cached_property
    def tube(self) -> TubeController:
        """The controller that knows of disturbances, with the weights of the other one."""
        return TubeController(self.tightening, self.horizon, self.controller.Q, self.controller.R)

    @cached_property
    def controller(self) -> Controller:
        """The controller that does not."""
        return scaled_controller(self.tightening.given, self.horizon)


def experiments(results: Path) -> Iterator[Case]:
    """Yield the experiments with a disturbance, and their references from the fits below `results`."""
    for experiment in load_experiments().values():
        drawn_in = experiment.tightening
        if drawn_in is None:
            continue
        learned = read_fit(Results(experiment.name, results)).learned
        robust, nominal = (learned[name].reference for name in (ROBUST.name, JOINT.name))
        yield Case(experiment.name, drawn_in, robust, nominal, experiment.control.horizon, 300)


def random_systems(count: int) -> Iterator[Case]:
    """Yield random systems of one to three states whose references come near to their bounds, and are proved.

    Systems whose disturbances leave nothing, and references without a proof, are passed over.
    """
    seed = 0
    while count:
        found = random_case(seed)
        seed += 1
        if found is not None:
            count -= 1
            yield found


def random_case(seed: int, steps: int = 150) -> Case | None:
    """Return one of the random systems; None where its disturbances leave nothing, or its reference has no proof.

    Every other one is measured with noise.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    m = int(rng.integers(1, min(n, 2) + 1))
    A = rng.standard_normal((n, n))
    A *= rng.uniform(0.5, 1.1) / max(abs(np.linalg.eigvals(A)))
    X, U = rng.uniform(0.5, 2.0, n), rng.uniform(2.0, 6.0, m)
    try:
        system = LinearSystem(A, rng.standard_normal((n, m)), sampling_time=0.1)
        plant = ConstrainedSystem(system, Polytope.box(-X, X), Polytope.box(-U, U))
        shape = Zonotope(np.zeros(n), 1e-3 * rng.standard_normal((max(1, n - int(rng.integers(2))), n)))
        noise = Zonotope(np.zeros(n), 2e-4 * rng.standard_normal((n, n))) if seed % 2 else None
        small = tightening(plant, shape, noise=noise)
        size = Fraction(rng.uniform(0.2, 0.7) * small.largest_fraction)
        K = small.invariant.feedback if small.invariant else None
        drawn_in = tightening(plant, shape.scaled(size), K, noise=noise.scaled(size) if noise else None)
    except ValueError:  # not controllable, or nothing is left
        return None
    horizon = max(_HORIZON, shortest_horizon(plant))
    robust, nominal = (_near_bounds(of, rng.spawn(1)[0], steps + horizon) for of in (drawn_in.plant, plant))
    end = (steps + horizon) * 0.1
    proofs = (prove_on_window(reference, 0.0, end) for reference in (robust, nominal))
    if not all(isinstance(proof, Certificate) for proof in proofs):
        return None
    return Case(f"random {seed}", drawn_in, robust, nominal, horizon, steps)


def _near_bounds(plant: ConstrainedSystem, rng: np.random.Generator, steps: int) -> Reference:
    """Return a reference that takes 0.95 of the way from zero to the first bound, at the steps."""
    kernel, centres = SquaredExponential(1.0, 1.5), np.arange(0.0, 0.1 * steps + 1.0, 1.2)
    weights = [rng.standard_normal(centres.size) for _ in range(plant.signal_count)]
    wild = Reference(tuple(KernelSum(kernel, 0.0, centres, w) for w in weights), plant)
    k = np.arange(steps + 1.0)
    used = max(
        float(np.max(np.maximum(values @ bounded.rows.T / bounded.upper, values @ bounded.rows.T / bounded.lower)))
        for values, bounded in ((wild.state(k), plant.state_set), (wild.input(k), plant.input_set))
    )
    return Reference(tuple(KernelSum(kernel, 0.0, centres, _PART / used * w) for w in weights), plant)
