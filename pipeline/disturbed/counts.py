"""Disturbed runs of the tube controller and of the nominal one, and what is counted of them."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from pipeline.disturbed.cases import Case
from trackable.arrays import Array
from trackable.control.closed_loop import ClosedLoop
from trackable.control.simulation import simulate
from trackable.control.step.result import Plan
from trackable.control.stepping import Disturbances
from trackable.control.tube.disturbances import Constant, Drawn, Greedy
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.reference import Reference

_NOMINAL_EVERY = 20
_OFF_EVERY = 20
_WARM_UP = 30


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
        error = _start(case, i)
        loop = simulate(case.tube, case.robust, case.robust.state(0) + error, case.steps, disturbances=disturbances)
        found.runs += 1
        found.steps += len(loop.inputs)
        found.broken += _broken(loop, case.tightening.given)
        found.without_plan += len(loop.without_plan)
        if i % _NOMINAL_EVERY == 0:
            found.compared += 1
            first = _nominal_fails(case, case.nominal, i)
            found.first_failures += [] if first is None else [first]
            found.nominal_failed += first is not None
            found.nominal_on_robust_failed += _nominal_fails(case, case.robust, i) is not None
    return found


def _kinds(case: Case) -> Iterator[tuple[int, Disturbances]]:
    for i in count():
        yield i, _kind(case, i)


def _kind(case: Case, i: int) -> Disturbances:
    """Return the disturbances of run i, the same each time."""
    W, given, rng = case.tube.invariant.disturbance, case.tightening.given, np.random.default_rng(i)
    if i % 3 == 0:
        return Greedy(W, given.state_set)
    return Drawn(W, i) if i % 3 == 1 else Constant(W, rng.standard_normal(W.dimension))


def _start(case: Case, i: int) -> Array:
    """Return an error in Z that disturbances have caused; for every twentieth run any from which there is a plan."""
    rng, Z = np.random.default_rng(i), case.tube.invariant
    e = np.zeros(Z.disturbance.dimension)
    for _ in range(_WARM_UP):
        e = Z.closed_loop @ e + Z.disturbance.farthest(rng.standard_normal(len(e)))
    if i % _OFF_EVERY:
        return e
    off = rng.standard_normal(len(e)) / np.sqrt(np.diag(case.controller.Q))
    while not isinstance(case.tube.step(0, case.robust.state(0) + off, case.robust), Plan):
        off = off / 2
    return np.asarray(off)


def _nominal_fails(case: Case, reference: Reference, i: int) -> int | None:
    """Return the first step at which the nominal controller has no plan or a bound is broken, from the reference on."""
    loop = simulate(case.controller, reference, reference.state(0), case.steps, disturbances=_kind(case, i))
    outside = np.flatnonzero(case.tightening.given.state_set.margin(loop.states) < 0).tolist()
    steps = [*outside[:1], *(result.k for result in loop.without_plan[:1])]
    return min(steps, default=None)


def _broken(loop: ClosedLoop, plant: ConstrainedSystem) -> int:
    """Count the states and inputs outside of their sets, without any tolerance; the first state is a given one."""
    states, inputs = plant.state_set.margin(loop.states[1:]), plant.input_set.margin(loop.inputs)
    return int(np.sum(states < 0) + np.sum(inputs < 0))
