"""Count how often the tube controller breaks a bound or has no plan: `python -m benchmarks.disturbed STEPS`.

It runs a million steps by default, under the disturbances of experiments and of random systems. The control stage
compares the tube controller with the nominal controller.
"""

import itertools
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import click
import numpy as np

from pipeline.experiments import load_experiments
from pipeline.loops.disturbed import KINDS, controllers, disturbed_loop, near_bounds, start, violations
from pipeline.methods import ROBUST
from pipeline.storage.archive import read_fit
from pipeline.storage.results import Results
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove
from trackably.checker.certificate import Window
from trackably.control.controller import shortest_horizon
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening, tightening

_HORIZON = 15


@dataclass(frozen=True, eq=False)
class Case:
    """A plant with tightened bounds, and a `robust` reference that is proved to keep these bounds for `steps` steps."""

    name: str
    tightening: Tightening
    robust: Reference
    horizon: int
    steps: int


def experiments() -> Iterator[Case]:
    """Yield the experiments with a disturbance, and the robust references of their results."""
    for experiment in load_experiments().values():
        tightened = experiment.tightening
        if tightened is None:
            continue
        robust = read_fit(Results(experiment.name)).learned[ROBUST.name].reference
        yield Case(experiment.name, tightened, robust, experiment.control.horizon, 300)


def random_systems(count: int) -> Iterator[Case]:
    """Return random systems of one to three states whose references come near to their bounds, and are proved.

    Systems are left out if the tightening for disturbances leaves no admissible states or inputs, or if the reference
    is not proved.
    """
    return islice(filter(None, map(random_case, itertools.count())), count)


def random_case(seed: int, steps: int = 150) -> Case | None:
    """Return one of the random systems, by its `seed`.

    None if the system is not controllable, the tightening for disturbances leaves no admissible states or inputs, or
    the reference is not proved. States of every other system are measured with noise.
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
        size = rng.uniform(0.2, 0.7) * small.largest_fraction
        pushed, shaken = (of and Zonotope(np.zeros(n), size * of.generator_matrix) for of in (shape, noise))
        tightened = tightening(plant, pushed, small.invariant.feedback, noise=shaken)
    except ValueError:  # not controllable, or tightened bounds leave nothing
        return None
    horizon = max(_HORIZON, shortest_horizon(plant))
    last = steps + horizon
    robust = near_bounds(tightened.plant, rng.spawn(1)[0], last, 0.95)
    if not isinstance(prove(robust, Window(0.0, last * 0.1)), Certificate):
        return None
    return Case(f"random {seed}", tightened, robust, horizon, steps)


def disturbed_runs(case: Case, steps: int) -> Counter[str]:
    """Run loops of at least `steps` steps in all; count steps, runs, steps outside of bounds and steps without a plan.

    Disturbances are greedy, drawn and constant in turn. Runs start in x_r ⊕ Z; Z is the invariant set of the error.
    """
    found, tube = Counter[str](), controllers(case.tightening, case.horizon)["tube"]
    while found["steps"] < steps:
        seed, kind = found["runs"], KINDS[found["runs"] % 3]
        first = start(case.tightening, case.robust.state(0), seed)
        loop = disturbed_loop(case.tightening, tube, case.robust, first, range(case.steps), kind, seed)
        seen = violations(loop, case.tightening.given)
        found.update(runs=1, **{name: seen[name] for name in ("steps", "steps_outside", "steps_without_plan")})
    return found


_RANDOM = 16


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("steps", type=click.IntRange(1), default=1_000_000)
def command(steps: int) -> None:
    """Count broken bounds and steps without a plan in STEPS disturbed steps.

    The systems are those of the experiments with a disturbance, and random systems.
    """
    cases, every = [*experiments(), *random_systems(_RANDOM)], Counter[str]()
    for case in cases:
        found = disturbed_runs(case, -(-steps // len(cases)))
        click.echo(_told(case.name, found))
        every.update(found)
    click.echo(_told("all", every))


def _told(name: str, found: Counter[str]) -> str:
    return (
        f"{name}: {found['steps']} steps in {found['runs']} runs: {found['steps_outside']} outside of the bounds, "
        f"{found['steps_without_plan']} without a plan"
    )


if __name__ == "__main__":
    command()
