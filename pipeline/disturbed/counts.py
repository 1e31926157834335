"""Disturbed runs of the tube controller and of the nominal one, and what is counted of them."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from pipeline.disturbed import runs
from pipeline.disturbed.cases import Case
from trackably.arrays import Array
from trackably.control.simulation import ClosedLoop, simulate
from trackably.control.stepping import Disturbances, Plan
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference

_NOMINAL_EVERY = 20
_OFF_EVERY = 20


@dataclass
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
    first_failures: list[int] = field(default_factory=list)

    def __str__(self) -> str:
        first = f", first at step {int(np.median(self.first_failures))} (median)" if self.first_failures else ""
        return (
            f"{self.name}: {self.steps} steps in {self.runs} runs; tube controller: {self.broken} bounds broken, "
            f"{self.without_plan} steps without a plan; nominal controller, {self.compared} of these runs: fails in "
            f"{self.nominal_failed} on the nominal reference{first}, in {self.nominal_on_robust_failed} on the robust "
            "one"
        )


def disturbed_runs(case: Case, steps: int) -> Counts:
    """Run the loops for at least so many steps of the tube controller: greedy, drawn and constant disturbances in turn.

    Most runs start in x_r ⊕ Z, every twentieth one off the tube.
    """
    found = Counts(case.name)
    for i, disturbances in _kinds(case):
        if found.steps >= steps:
            return found
        noise = _noise(case, i)
        first = _start(case, i) - (0.0 if noise is None else noise(0, case.robust.state(0)))
        loop = simulate(
            case.tube,
            case.robust,
            case.robust.state(0) + first,
            case.steps,
            disturbances=disturbances,
            noise=_noise(case, i),
        )
        found.runs += 1
        found.steps += len(loop.inputs)
        found.broken += _broken(loop, case.tightening.given)
        found.without_plan += len(loop.without_plan)
        if i % _NOMINAL_EVERY == 0:
            found.compared += 1
            failure = _nominal_fails(case, case.nominal, i)
            found.first_failures += [] if failure is None else [failure]
            found.nominal_failed += failure is not None
            found.nominal_on_robust_failed += _nominal_fails(case, case.robust, i) is not None
    return found


def _kinds(case: Case) -> Iterator[tuple[int, Disturbances]]:
    for i in count():
        yield i, _kind(case, i)


def _kind(case: Case, i: int) -> Disturbances:
    """Return the disturbances of run i, the same each time."""
    return runs.disturbances(("greedy", "drawn", "constant")[i % 3], case.tightening, i)


def _noise(case: Case, i: int) -> Disturbances | None:
    """Return the measurement noise of run i, if there is some, the same each time."""
    return runs.noise(case.tightening, i)


def _start(case: Case, i: int) -> Array:
    """Return an error of the measured state, in Z; for every twentieth run any from which there is a plan."""
    e = runs.start(case.tube.invariant, i)
    if i % _OFF_EVERY:
        return e
    rng = np.random.default_rng(i)
    off = rng.standard_normal(len(e)) / np.sqrt(np.diag(case.controller.Q))
    while not isinstance(case.tube.step(0, case.robust.state(0) + off, case.robust), Plan):
        off = off / 2
    return np.asarray(off)


def _nominal_fails(case: Case, reference: Reference, i: int) -> int | None:
    """Return the first step at which the nominal controller has no plan or a bound is broken, from the reference on."""
    disturbances, noise = _kind(case, i), _noise(case, i)
    loop = simulate(case.controller, reference, reference.state(0), case.steps, disturbances=disturbances, noise=noise)
    outside = np.flatnonzero(case.tightening.given.state_set.margin(loop.states) < 0).tolist()
    steps = [*outside[:1], *(result.k for result in loop.without_plan[:1])]
    return min(steps, default=None)


def _broken(loop: ClosedLoop, plant: ConstrainedSystem) -> int:
    """Count the states and inputs outside of their sets, without any tolerance; the first state is a given one."""
    states, inputs = plant.state_set.margin(loop.states[1:]), plant.input_set.margin(loop.inputs)
    return int(np.sum(states < 0) + np.sum(inputs < 0))
