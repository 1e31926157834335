"""Loops under an experiment's disturbances, by the tube controller and by the nominal one."""

from collections.abc import Mapping

import numpy as np

from pipeline.disturbed.runs import COUNT, disturbances, many_runs, noise
from pipeline.experiments import Experiment
from pipeline.methods import ROBUST
from pipeline.storage.disturbed import Disturbed
from trackably.control.controller import Controller, scaled_controller
from trackably.control.loop_trajectory import LoopTrajectory
from trackably.control.references import TrackedReference
from trackably.control.simulation import ClosedLoop, apply_fallback_for, simulate
from trackably.control.stepping import SteppedController
from trackably.control.tube import TubeController
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbance.tightening import Tightening

KINDS = ("drawn", "greedy", "constant")
_MOST_STEPS, _PATIENCE = 300, 30
Numbers = dict[str, float | int | str | None]


def disturbed_loops(
    experiment: Experiment, references: Mapping[str, TrackedReference]
) -> tuple[Disturbed, dict[str, object]]:
    """Return the loops by reference, controller and kind of disturbance, many runs, and the numbers of both.

    All of them begin on the reference, or in the tube around it, and last as long as figures show, 300 steps at most.
    After 30 steps without a plan a loop ends.
    """
    drawn_in = experiment.tightening
    assert drawn_in, "asked for where there is a disturbance"
    loops: dict[str, dict[str, dict[str, LoopTrajectory]]] = {}
    numbers: dict[str, dict[str, dict[str, Numbers]]] = {}
    for name, reference in references.items():
        loops[name], numbers[name] = {}, {}
        for controller, of in _controllers(experiment, drawn_in).items():
            found = {kind: _loop(experiment, drawn_in, of, reference, kind) for kind in KINDS}
            loops[name][controller] = {kind: LoopTrajectory.of(loop) for kind, loop in found.items()}
            numbers[name][controller] = {kind: _numbers(loop, drawn_in.given) for kind, loop in found.items()}
    steps = _steps(experiment)
    runs, broken = many_runs(drawn_in, references[ROBUST.name].window(steps.start, len(steps)), steps.start)
    of_runs = {"runs": COUNT, "steps": COUNT * len(steps), "broken": broken}
    return Disturbed(loops, runs), {**numbers, "tube": of_runs}


def _controllers(experiment: Experiment, drawn_in: Tightening) -> dict[str, SteppedController]:
    wanted = experiment.control
    nominal: Controller = scaled_controller(drawn_in.given, wanted.horizon, wanted.input_weight)
    return {"nominal": nominal, "tube": TubeController(drawn_in, wanted.horizon, nominal.Q, nominal.R)}


def _loop(
    experiment: Experiment, drawn_in: Tightening, controller: SteppedController, reference: TrackedReference, kind: str
) -> ClosedLoop:
    """Run one loop from the reference on. Where there is no plan, the fallback is applied."""
    steps = _steps(experiment)
    return simulate(
        controller,
        reference,
        reference.window(steps.start, 1).states[0],
        len(steps),
        first_step=steps.start,
        on_infeasible=apply_fallback_for(_PATIENCE),
        disturbances=disturbances(kind, drawn_in, 0),
        noise=noise(drawn_in, 0),
    )


def _steps(experiment: Experiment) -> range:
    return experiment.loop_steps[: min(experiment.control.shown, _MOST_STEPS)]


def _numbers(loop: ClosedLoop, given: ConstrainedSystem) -> Numbers:
    states, inputs = given.state_set.margin(loop.states[1:]), given.input_set.margin(loop.inputs)
    outside = np.flatnonzero((states < 0) | (inputs < 0))
    return {
        "steps": len(loop.inputs),
        "steps_without_plan": len(loop.without_plan),
        "first_step_without_plan": loop.without_plan[0].k if loop.without_plan else None,
        "why": loop.without_plan[0].explanation if loop.without_plan else None,
        "steps_outside": len(outside),
        "first_step_outside": loop.first_step + int(outside[0]) if len(outside) else None,
        "worst_state_margin": float(np.min(states)),
        "worst_input_margin": float(np.min(inputs)),
    }
