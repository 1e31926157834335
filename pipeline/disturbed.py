"""Count what happens to the tube controller and to the nominal one: `python -m pipeline.disturbed [STEPS [RESULTS]]`.

A million steps by default, under the disturbances of experiments and of random systems.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from fractions import Fraction
from functools import cached_property
from itertools import count
from pathlib import Path

import click
import numpy as np

from pipeline.experiments import load_experiments
from pipeline.loops.disturbed import disturbed_plant, noise, start
from pipeline.methods import JOINT, ROBUST
from pipeline.storage.archive import read_fit
from pipeline.storage.results import Results
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove_on_window
from trackably.control.controller import Controller, scaled_controller, shortest_horizon
from trackably.control.simulation import ClosedLoop, simulate
from trackably.control.stepping import Disturbances, Plan, SteppedController, Successor
from trackably.control.tube import TubeController
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening, tightening

_HORIZON, _PART = 15, 0.95


@dataclass(frozen=True, eq=False)
class Case:
    """A plant with tightened bounds, a reference proved for these, and a `nominal` one proved without disturbance.

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
        """The controller that leaves room for disturbances, with the weights of `controller`."""
        return TubeController(self.tightening, self.horizon, self.controller.Q, self.controller.R)

    @cached_property
    def controller(self) -> Controller:
        """The nominal controller, which leaves no room for disturbances."""
        return scaled_controller(self.tightening.given, self.horizon)


def experiments(results: Path) -> Iterator[Case]:
    """Yield the experiments with a disturbance, and their references from the fits below `results`."""
    for experiment in load_experiments().values():
        tightened = experiment.tightening
        if tightened is None:
            continue
        learned = read_fit(Results(experiment.name, results)).learned
        robust, nominal = (learned[name].reference for name in (ROBUST.name, JOINT.name))
        yield Case(experiment.name, tightened, robust, nominal, experiment.control.horizon, 300)


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

    Every other system is measured with noise.
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
        tightened = tightening(plant, shape.scaled(size), K, noise=noise.scaled(size) if noise else None)
    except ValueError:  # not controllable, or nothing is left
        return None
    horizon = max(_HORIZON, shortest_horizon(plant))
    robust, nominal = (_near_bounds(of, rng.spawn(1)[0], steps + horizon) for of in (tightened.plant, plant))
    end = (steps + horizon) * 0.1
    proofs = (prove_on_window(reference, 0.0, end) for reference in (robust, nominal))
    if not all(isinstance(proof, Certificate) for proof in proofs):
        return None
    return Case(f"random {seed}", tightened, robust, nominal, horizon, steps)


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


_KINDS = ("greedy", "drawn", "constant")
_NOMINAL_EVERY = 20
_OFF_EVERY = 20


@dataclass(frozen=True)
class Counts:
    """Steps and runs of the tube controller; of some runs also those of the nominal one, on two references."""

    name: str
    steps: int = 0
    runs: int = 0
    broken: int = 0
    without_plan: int = 0
    compared: int = 0
    nominal_failed: int = 0
    nominal_on_robust_failed: int = 0
    first_failures: tuple[int, ...] = ()

    def __add__(self, other: "Counts") -> "Counts":
        sums = {each.name: getattr(self, each.name) + getattr(other, each.name) for each in fields(Counts)[1:]}
        return Counts(self.name, **sums)

    def __str__(self) -> str:
        first = f", first at step {int(np.median(self.first_failures))} (median)" if self.first_failures else ""
        return (
            f"{self.name}: {self.steps} steps in {self.runs} runs; tube controller: {self.broken} bounds broken, "
            f"{self.without_plan} steps without a plan; nominal controller, {self.compared} of these runs: fails in "
            f"{self.nominal_failed} on the nominal reference{first}, in {self.nominal_on_robust_failed} on the robust "
            "one"
        )


def disturbed_runs(case: Case, steps: int) -> Counts:
    """Run loops until the tube controller has made at least `steps` steps, and count what happens.

    Disturbances are greedy, drawn and constant in turn. Most runs start in x_r ⊕ Z, and every twentieth outside of it.
    """
    found, given = Counts(case.name), case.tightening.given
    for i in count():
        if found.steps >= steps:
            break
        measured = noise(case.tightening, i)
        first = case.robust.state(0) + _start_of(case, i)
        first = first if measured is None else first - measured(0, case.robust.state(0))
        loop = _loop(case, case.tube, case.robust, first, i)
        # Bounds have no tolerance here. The first state is given, so it is not counted.
        states, inputs = given.state_set.margin(loop.states[1:]), given.input_set.margin(loop.inputs)
        broken = int(np.sum(states < 0) + np.sum(inputs < 0))
        found += Counts("", len(loop.inputs), 1, broken, len(loop.without_plan))
        if i % _NOMINAL_EVERY == 0:
            failures = [_nominal_fails(case, reference, i) for reference in (case.nominal, case.robust)]
            at = () if failures[0] is None else (failures[0],)
            on_nominal, on_robust = (failure is not None for failure in failures)
            found += Counts("", 0, 0, 0, 0, 1, on_nominal, on_robust, at)
    return found


def plant_of(case: Case, i: int) -> tuple[Successor, Disturbances]:
    """Return the plant and the disturbances of run i; they are the same at each call."""
    return disturbed_plant(_KINDS[i % 3], case.tightening, i)


def _loop(case: Case, controller: SteppedController, reference: Reference, first: Array, i: int) -> ClosedLoop:
    (moved, pushed), measured = plant_of(case, i), noise(case.tightening, i)
    return simulate(
        controller,
        reference,
        first,
        case.steps,
        disturbances=pushed,
        measurement_noise=measured,
        successor=moved,
    )


def _start_of(case: Case, i: int) -> Array:
    """Return the first error of the measured state: in Z, or for every twentieth run any error that allows a plan."""
    e = start(case.tube.invariant, i)
    if i % _OFF_EVERY:
        return e
    rng = np.random.default_rng(i)
    off = rng.standard_normal(len(e)) / np.sqrt(np.diag(case.controller.Q))
    while not isinstance(case.tube.step(0, case.robust.state(0) + off, case.robust), Plan):
        off = off / 2
    return np.asarray(off)


def _nominal_fails(case: Case, reference: Reference, i: int) -> int | None:
    """Return the first step at which the nominal controller has no plan or breaks a bound; it starts on `reference`."""
    loop = _loop(case, case.controller, reference, reference.state(0), i)
    outside = np.flatnonzero(case.tightening.given.state_set.margin(loop.states) < 0).tolist()
    steps = [*outside[:1], *(result.k for result in loop.without_plan[:1])]
    return min(steps, default=None)


_RANDOM = 16


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("steps", type=click.IntRange(1), default=1_000_000)
@click.argument("results", type=click.Path(exists=True, file_okay=False, path_type=Path), default=Path("data/results"))
def command(steps: int, results: Path) -> None:
    """Count what becomes of STEPS disturbed steps: of the experiments in RESULTS, and of random systems."""
    cases, every = [*experiments(results), *random_systems(_RANDOM)], Counts("all")
    for case in cases:
        found = disturbed_runs(case, -(-steps // len(cases)))
        print(found, flush=True)
        every += found
    print(every)


if __name__ == "__main__":
    command()
