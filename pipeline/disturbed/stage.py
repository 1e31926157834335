"""Loops under an experiment's disturbances, by the tube controller and by the nominal one: numbers for the metrics."""

from collections.abc import Mapping

import numpy as np

from pipeline.experiments import Experiment
from trackable.control.controller import Controller
from trackable.control.references import TrackedReference
from trackable.control.scaling import scaled_controller
from trackable.control.simulation import apply_fallback_for, simulate
from trackable.control.stepping import Disturbances, SteppedController
from trackable.control.tube.controller import TubeController
from trackable.control.tube.disturbances import Constant, Drawn, Greedy
from trackable.systems.disturbance.sets import DisturbanceSet
from trackable.systems.disturbance.tightening import Tightening
from trackable.systems.sets.polytope import Polytope

Numbers = dict[str, float | int | str | None]
KINDS = ("drawn", "greedy", "constant")


def disturbed_loops(
    experiment: Experiment, references: Mapping[str, TrackedReference]
) -> dict[str, dict[str, dict[str, Numbers]]]:
    """Return the numbers of loops by reference, controller and kind of disturbance; none without disturbance."""
    drawn_in = experiment.tightening
    if drawn_in is None or drawn_in.invariant is None:
        return {}
    wanted = experiment.control
    nominal = scaled_controller(drawn_in.given, wanted.horizon, wanted.input_weight)
    tube = TubeController(drawn_in, wanted.horizon, nominal.Q, nominal.R)
    controllers: dict[str, Controller | TubeController] = {"tube": tube, "nominal": nominal}
    return {
        name: {
            of: {kind: _loop(experiment, drawn_in, controller, reference, kind) for kind in KINDS}
            for of, controller in controllers.items()
        }
        for name, reference in references.items()
    }


def _loop(
    experiment: Experiment, drawn_in: Tightening, controller: SteppedController, reference: TrackedReference, kind: str
) -> Numbers:
    """Return the numbers of one loop from the reference on, as long as logs are.

    Where there is no plan, the fallback is applied.
    """
    steps, given = experiment.loop_steps[: experiment.control.logged], drawn_in.given
    assert drawn_in.invariant is not None, "loops are disturbed where there is a set"
    loop = simulate(
        controller,
        reference,
        reference.window(steps.start, 1).states[0],
        len(steps),
        first_step=steps.start,
        on_infeasible=apply_fallback_for(experiment.control.patience),
        disturbances=_disturbances(kind, drawn_in.invariant.disturbance, given.state_set),
    )
    states, inputs = given.state_set.margin(loop.states[1:]), given.input_set.margin(loop.inputs)
    outside = np.flatnonzero((states < 0) | (inputs < 0))
    return {
        "steps": len(loop.inputs),
        "steps_without_plan": len(loop.without_plan),
        "first_step_without_plan": loop.without_plan[0].k if loop.without_plan else None,
        "steps_outside": len(outside),
        "first_step_outside": steps.start + int(outside[0]) if len(outside) else None,
        "worst_state_margin": float(np.min(states)),
        "worst_input_margin": float(np.min(inputs)),
    }


def _disturbances(kind: str, W: DisturbanceSet, state_set: Polytope) -> Disturbances:
    if kind == "drawn":
        return Drawn(W, 0)
    return Greedy(W, state_set) if kind == "greedy" else Constant(W, np.ones(W.dimension))
