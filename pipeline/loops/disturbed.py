"""Loops under an experiment's disturbances with two controllers, hundreds of runs, and the price of robustness."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from pipeline.experiments import Experiment
from pipeline.loops.trajectory import Course, many_courses
from pipeline.methods import JOINT, ROBUST, UNCONSTRAINED
from pipeline.storage.archive import Fitted, Sampled
from trackably.arrays import Array, root_mean_square
from trackably.certificates.certified import Certified, learn_certified
from trackably.control.controller import Controller
from trackably.control.references import TrackedReference
from trackably.control.simulation import ClosedLoop, apply_fallback_for, simulate
from trackably.control.stepping import Disturbances, Successor
from trackably.control.tube import TubeController
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.learning import learner
from trackably.learning.joint.search import learn_from
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import DisturbanceSet
from trackably.systems.polytopes import slacks
from trackably.systems.reference import Reference, Window
from trackably.systems.tightening import Tightening


def drawn(of: DisturbanceSet, seed: int) -> Disturbances:
    """Return a function that draws another point of a set at each call, and the same sequence for the same seed."""
    rng = np.random.default_rng(seed)
    return lambda k, successor: of.draw(rng)


COUNT, KEPT = 300, 9
KINDS = ("drawn", "greedy", "constant")
_WARM_UP = 60


def disturbed_plant(kind: str, tightened: Tightening, seed: int) -> tuple[Successor, Disturbances]:
    """Return the plant's successor function and its disturbances in W, which are drawn, greedy or constant.

    A greedy disturbance takes the state furthest towards its nearest bound, relative to the width between bounds; a
    constant one is always the point that lies farthest in one direction. The plant obeys its model. With a model error,
    it obeys one of the error's vertices: "drawn" draws a vertex at each step, "greedy" takes the vertex that brings the
    state nearest to a bound, and "constant" keeps the same vertex.
    """
    W, X, of_plant = tightened.disturbance, tightened.given.state_set, np.random.default_rng(seed)
    assert W is not None, "loops are disturbed where there is a set"
    rows, _ = X.inequalities
    farthest = W.farthest(np.random.default_rng(seed).standard_normal(W.dimension))
    pushed: Disturbances = {
        "drawn": drawn(W, seed),
        "greedy": lambda k, successor: W.farthest(rows[int(np.argmin(slacks(X, successor)))]),
        "constant": lambda k, successor: farthest,
    }[kind]
    if tightened.model_error is None:
        return lambda k, x, u: tightened.given.linear.successor(x, u), pushed
    vertices = tightened.model_error.vertices
    same = int(of_plant.integers(len(vertices)))

    def moved(k: int, x: Array, u: Array) -> Array:
        found = [v.A @ x + v.B @ u + v.c for v in vertices]
        if kind == "greedy":
            return min(found, key=lambda successor: float(np.min(slacks(X, successor))))
        return found[int(of_plant.integers(len(found))) if kind == "drawn" else same]

    return moved, pushed


def noise(tightened: Tightening, seed: int) -> Disturbances | None:
    """Return noise drawn from V, independently of the disturbances; None if the state is measured without noise."""
    return None if tightened.noise is None else drawn(tightened.noise, 10**6 + seed)


def start(tightened: Tightening, x_r: Array, seed: int) -> Array:
    """Return a state (n,) whose measured value lies in x_r ⊕ Z; Z is the invariant set of the error.

    A sequence of extreme disturbances in W has caused the error, starting from zero.
    """
    Z, rng, measured = tightened.invariant, np.random.default_rng(seed), noise(tightened, seed)
    assert Z is not None, "loops are disturbed where there is a set"
    e = np.zeros(len(x_r))
    for _ in range(_WARM_UP):
        e = Z.closed_loop @ e + Z.disturbance.farthest(rng.standard_normal(len(e)))
    return np.asarray(x_r + e if measured is None else x_r + e - measured(0, x_r))


def many_runs(tightened: Tightening, window: Window, first_step: int) -> tuple[dict[str, Course], int]:
    """Return runs along the window of a robust reference by topic, and how often a bound was broken in them.

    The measured state begins in x_r ⊕ Z. There, the plan of the tube controller is the reference: it applies
    u = u_r + K (y − x_r), and no program has to be solved. Disturbances are drawn, greedy and constant in turn, from
    run to run; measurement noise is drawn.
    """
    runs = np.array([_run(tightened, window, first_step, r) for r in range(COUNT)])
    n, given = window.states.shape[1], tightened.given
    broken = np.sum(given.state_set.margin(runs[:, 1:, :n]) < 0) + np.sum(given.input_set.margin(runs[..., n:]) < 0)
    steps = first_step + np.arange(runs.shape[1], dtype=float)
    return many_courses(steps, given, runs, KEPT), int(broken)


def _run(tightened: Tightening, window: Window, first_step: int, r: int) -> Array:
    """Return states and inputs (K, n + m) of one run."""
    Z, kind = tightened.invariant, KINDS[r % 3]
    assert Z is not None, "loops are disturbed where there is a set"
    (move, pushed), measured = disturbed_plant(kind, tightened, r), noise(tightened, r)
    x, course = start(tightened, window.states[0], r), []
    for k, (x_r, u_r) in enumerate(zip(window.states, window.inputs, strict=False), first_step):
        y = x if measured is None else x + measured(k, x_r)
        u = u_r + Z.feedback @ (y - x_r)
        course.append(np.concatenate([x, u]))
        successor = move(k, x, u)
        x = successor + pushed(k, successor)
    return np.array(course)


_MOST_STEPS, _PATIENCE = 300, 30


def disturbed_loops(
    experiment: Experiment, references: Mapping[str, TrackedReference]
) -> tuple[dict[str, Course], dict[str, object]]:
    """Return disturbed loops and many runs by their topics in the log, and the metrics of both.

    There is a loop for each reference, controller and kind of disturbance. Loops begin on the reference, and runs in
    the tube around it. Both have as many steps as figures show, 300 at most. A loop ends after 30 steps without a plan.
    """
    tightened = experiment.tightening
    assert tightened, "asked for where there is a disturbance"
    steps = experiment.loop_steps[: min(experiment.control.shown, _MOST_STEPS)]
    loops: dict[str, Course] = {}
    numbers: dict[str, dict[str, object]] = {name: {} for name in references}
    for name, reference in references.items():
        begun, plant = reference.window(steps.start, 1).states[0], tightened.given
        for controller, of in controllers(tightened, experiment.control.horizon).items():
            found = {kind: disturbed_loop(tightened, of, reference, begun, steps, kind, 0) for kind in KINDS}
            loops |= {f"/disturbed/{name}/{controller}/{kind}": Course.of(loop, plant) for kind, loop in found.items()}
            numbers[name][controller] = {kind: violations(loop, plant) for kind, loop in found.items()}
    runs, broken = many_runs(tightened, references[ROBUST.name].window(steps.start, len(steps)), steps.start)
    of_runs = {"runs": COUNT, "steps": COUNT * len(steps), "broken": broken}
    return {**loops, **runs}, {**numbers, "tube": of_runs}


def controllers(tightened: Tightening, horizon: int) -> dict[str, Controller]:
    """Return the controller that ignores disturbances, and the one that leaves room for them, with the same cost."""
    nominal = Controller(tightened.given, horizon)
    return {"nominal": nominal, "tube": TubeController(tightened, horizon, nominal.Q, nominal.R)}


def disturbed_loop(
    tightened: Tightening,
    controller: Controller,
    reference: TrackedReference,
    state: Array,
    steps: range,
    kind: str,
    seed: int,
) -> ClosedLoop:
    """Run one loop from a state (n,) on: the fallback is applied at 30 steps without a plan, then the loop ends."""
    moved, pushed = disturbed_plant(kind, tightened, seed)
    return simulate(
        controller,
        reference,
        state,
        len(steps),
        first_step=steps.start,
        on_infeasible=apply_fallback_for(_PATIENCE),
        disturbances=pushed,
        measurement_noise=noise(tightened, seed),
        successor=moved,
    )


def violations(loop: ClosedLoop, given: ConstrainedSystem) -> dict[str, Any]:
    """Return the numbers of steps, of those without a plan, and of those outside of the bounds, by name.

    Bounds have no tolerance here. The first state is given, so it is not counted.
    """
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


Columns = dict[str, list[float] | float]


def prices(experiment: Experiment, fitted: Fitted) -> Columns:
    """Return `sizes` of W and V as factors of the given sets, and for each the `price` J − min l and the `misfit`.

    The reference of size 0 is `joint`, and that of size 1 is `robust`. References for other sizes are learned here for
    the same feedback, and proved: the first one from the hyperparameters of `robust`, each later one from those of the
    reference learned before it. Sizes without a proved reference are left out. `largest` is the size from which on
    tightened bounds leave no admissible states or inputs.
    """
    tightened = experiment.tightening
    assert tightened, "asked for where there is a disturbance"
    assert experiment.disturbance, "bounds are tightened for one"
    least = fitted.learned[UNCONSTRAINED.name].nlml

    def misfit(reference: Reference) -> float:
        return root_mean_square([*fitted.sampled.distances(reference.signals).values()])

    rows = {
        size: (fitted.learned[name].objective - least, misfit(fitted.learned[name].reference))
        for size, name in ((0.0, JOINT.name), (1.0, ROBUST.name))
    }
    start = fitted.learned[ROBUST.name].prior.log_hyperparameters
    for size in sorted(experiment.disturbance.sizes):
        found = _learned_for(experiment, fitted.sampled, tightened, size, start)
        if found is not None:
            rows[size] = (found.solution.objective - least, misfit(found.reference))
            start = found.solution.posterior.prior.log_hyperparameters
    columns = zip(*((size, *rows[size]) for size in sorted(rows)), strict=True)
    table = dict(zip(("sizes", "price", "misfit"), map(list, columns), strict=True))
    return {**table, "largest": tightened.largest_fraction}


def _learned_for(
    experiment: Experiment, sampled: Sampled, tightened: Tightening, size: float, start: Array
) -> Certified | None:
    try:
        plant = tightened.plant_for(size)
    except ValueError:  # tightened bounds leave nothing
        return None
    task = experiment.task(sampled.samples)
    nearby = replace(learner.JOINT, solve=partial(learn_from, (start,)), fallback=None)
    found = learn_certified(task.problem, plant, task.goal, learner=nearby)
    return found if isinstance(found, Certified) else None


def near_bounds(plant: ConstrainedSystem, rng: np.random.Generator, steps: int, part: float) -> Reference:
    """Return a reference whose values at the steps reach the given `part` of the way from zero to the first bound."""
    step = plant.sampling_time
    kernel, centres = SquaredExponential(1.0, 15 * step), step * np.arange(0.0, steps + 10.0, 12.0)
    weights = [rng.standard_normal(centres.size) for _ in range(plant.signal_count)]
    wild = Reference(tuple(KernelSum(kernel, 0.0, centres, w) for w in weights), plant)
    k = np.arange(steps + 1.0)
    used = max(
        float(np.max(np.maximum(values @ bounded.rows.T / bounded.upper, values @ bounded.rows.T / bounded.lower)))
        for values, bounded in ((wild.state(k), plant.state_set), (wild.input(k), plant.input_set))
    )
    return Reference(tuple(KernelSum(kernel, 0.0, centres, part / used * w) for w in weights), plant)
