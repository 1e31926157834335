"""All steps of disturbed closed loops: the tube controller beside the nominal one, on the learned references.

The tube controller closes the loop; at each of its states both are timed. Some loops begin on the edge of what the tube
controller can recover from, others on the reference. The nominal controller has the same tightened bounds, or the given
ones, which are active less often.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.duel import Row
from benchmarks.loops.tube import HORIZON, RANDOM, TARGET, edge, seconds
from pipeline.disturbed import Case, experiments, random_systems
from pipeline.loops.disturbed import disturbances
from trackably.arrays import Array
from trackably.control.controller import Controller, scaled_controller
from trackably.control.stepping import Plan
from trackably.control.tube import TubeController

_FIRST, _STEPS, _RUNS = 10, 40, 2
_FARTHEST, _NEARER = 20.0, 0.7


def rows() -> Iterator[Row]:
    """Mean times of all steps, for each experiment with disturbances and for random systems together."""
    cases = {case.name: [case] for case in experiments(Path("data/results"))}
    cases["random systems"] = list(random_systems(RANDOM))
    for name, some in cases.items():
        for starts_off, start in ((True, "from far off"), (False, "from the reference")):
            times = np.array([time for case in some for run in range(_RUNS) for time in _times(case, starts_off, run)])
            for i, bounds in enumerate(("tightened", "given"), start=1):
                yield _row(f"{name}, {start}, {len(times)} steps", bounds, times[:, [0, i]])


def _row(problem: str, bounds: str, times: Array) -> Row:
    tube, nominal = times.mean(axis=0).tolist()
    lowest, latest = np.quantile(times[:, 0] / times[:, 1], [0.0, 0.95]).tolist()
    note = "means of all steps; the range ends at the 95th percentile of single steps"
    topic, rival = "disturbed loops of the tube controller", f"nominal controller, {bounds} bounds"
    return Row(topic, problem, rival, tube, nominal, tube / nominal, lowest, latest, TARGET, at_most=True, note=note)


def _times(case: Case, starts_off: bool, run: int) -> Iterator[tuple[float, ...]]:
    """Yield the seconds of the tube controller, and of the nominal one with both bounds, at each state of one loop."""
    nominal = scaled_controller(case.tightening.given, HORIZON)
    tightened = Controller(case.tightening.plant, HORIZON, nominal.Q, nominal.R)
    tube = TubeController(case.tightening, HORIZON, nominal.Q, nominal.R)
    state = _far(case, tube, run) if starts_off else case.robust.state(_FIRST)
    system, push = case.tightening.given.linear, disturbances(("greedy", "drawn")[run % 2], case.tightening, run)
    for k in range(_FIRST, _FIRST + _STEPS):
        yield tuple(_seconds(controller, k, state, case) for controller in (tube, tightened, nominal))
        plan = tube.step(k, state, case.robust)
        assert isinstance(plan, Plan), f"step {k}: the tube controller has no plan"
        successor = system.successor(state, plan.input)
        state = successor + push(k + 1, successor)


def _seconds(controller: Controller | TubeController, k: int, state: Array, case: Case) -> float:
    return seconds(controller, k, state, case.robust)


def _far(case: Case, tube: TubeController, run: int) -> Array:
    """Return a state far off the tube from which there is a plan."""
    weights = np.diag(tube.Q)
    direction = np.random.default_rng(run).standard_normal(len(weights)) / np.sqrt(weights)
    off, on = _FARTHEST * edge(tube, direction), case.robust.state(_FIRST)
    while not isinstance(tube.step(_FIRST, on + off, case.robust), Plan):
        off = _NEARER * off
    return np.asarray(on + off)
