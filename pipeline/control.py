"""Stage 4: references → closed loops and their metrics, and references that are learned again while a loop runs."""

import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from tqdm import tqdm

from pipeline.disturbed.loops import disturbed_loops, prices
from pipeline.experiments import Experiment
from pipeline.experiments.load import read_fit_of
from pipeline.loops.feasible_set import feasible_over_time
from pipeline.loops.initial_states import ON, initial_states
from pipeline.loops.interpolated import InterpolatedReference
from pipeline.loops.metrics import first_untrackable_step, loop_metrics
from pipeline.loops.trajectory import LoopTrajectory
from pipeline.methods import JOINT, ROBUST, UNCONSTRAINED
from pipeline.relearn import relearn
from pipeline.storage.archive import Fitted
from pipeline.storage.loops import ClosedLoops, write_loops
from pipeline.storage.results import Results
from trackably.control.controller import Controller, scaled_controller
from trackably.control.references import TrackedReference
from trackably.control.simulation import ClosedLoop, apply_fallback_for, simulate
from trackably.errors import InputError
from trackably.files import read_json, write_json

INTERPOLATED = "interpolated"


def control(experiment: Experiment, results: Results) -> None:
    """Write the closed loops on every reference, and their metrics.

    They run at steps for which the certified reference is proved. Raises InputError where no controller exists, or
    where a window is too short for one.
    """
    fitted, wanted, plant = read_fit_of(experiment, results), experiment.control, experiment.plant
    try:
        controller = scaled_controller(plant, wanted.horizon, wanted.input_weight)
    except ValueError as error:
        raise InputError(f"experiment {experiment.name}: control: {error}") from error
    steps = experiment.loop_steps
    if not steps:
        raise InputError(
            f"experiment {experiment.name}: control: the window that is proved must be longer than the horizon, "
            f"{wanted.horizon} steps, got {experiment.claim}"
        )
    references = references_of(fitted)
    metrics: dict[str, object] = {"horizon": wanted.horizon}
    courses: dict[str, dict[str, LoopTrajectory]] = {}
    seconds: dict[str, float] = {}
    for name, reference in references.items():
        courses[name], found = {}, {}
        for start, loop, taken in _loops(experiment, controller, references[JOINT.name], reference, name):
            courses[name][start] = LoopTrajectory.of(loop).until(steps.start + wanted.logged)
            found[start] = loop_metrics(loop, plant)
            seconds[f"{name}, {start}: seconds per step"] = round(taken / max(1, len(loop.inputs)), 7)
        metrics[name] = {"first_untrackable_step": first_untrackable_step(reference, plant, steps), **found}
    online = relearn(experiment, fitted.sampled, controller)
    shown = range(steps.start, min(steps.start + wanted.shown, steps[-1]) + 1)
    feasible = feasible_over_time(controller, references[JOINT.name], wanted.horizons, shown)
    closed = ClosedLoops(courses, feasible)
    if online:
        metrics["online"] = {**loop_metrics(online.loop, plant), "offers": online.records}
        closed = replace(closed, online=LoopTrajectory.of(online.loop), offered=online.columns)
    if experiment.disturbance:
        followed = {name: fitted.learned[name].reference for name in (JOINT.name, ROBUST.name)}
        disturbed, metrics["disturbed"] = disturbed_loops(experiment, followed)
        metrics["price_of_room"] = prices(experiment, fitted)
        closed = replace(closed, disturbed=disturbed)
    write_loops(results, plant, closed, metrics)
    write_json(results.control, metrics)
    _note(results, seconds)


def references_of(fitted: Fitted) -> dict[str, TrackedReference]:
    """Return what the controller follows: the proved reference `joint`, the unconstrained mean, and straight lines.

    The lines connect the samples. There are none for samples that show only changes of a flat output.
    """
    joint = fitted.learned[JOINT.name].reference
    unconstrained = fitted.learned[UNCONSTRAINED.name].reference
    found: dict[str, TrackedReference] = {JOINT.name: joint, UNCONSTRAINED.name: unconstrained}
    with suppress(ValueError):  # samples of changes only
        found[INTERPOLATED] = InterpolatedReference(fitted.sampled.samples, joint.plant)
    return found


def _loops(
    experiment: Experiment, controller: Controller, certified: TrackedReference, reference: TrackedReference, name: str
) -> Iterator[tuple[str, ClosedLoop, float]]:
    """Yield the name of each initial state, the loop from there, and how long it took [s].

    The initial state `on` lies on `reference`; the others are those of the certified reference.
    """
    steps, patience = experiment.loop_steps, experiment.control.patience
    states = initial_states(controller, certified, steps.start) | {ON: reference.window(steps.start, 1).states[0]}
    for start, state in tqdm(states.items(), desc=f"{experiment.name}: {name}", disable=None):
        begin = time.perf_counter()
        loop = simulate(
            controller,
            reference,
            state,
            len(steps),
            first_step=steps.start,
            on_infeasible=apply_fallback_for(patience),
        )
        yield start, loop, time.perf_counter() - begin


def _note(results: Results, seconds: dict[str, float]) -> None:
    """Add wall-clock times to those of the fit."""
    before = read_json(results.timings) if results.timings.exists() else {}
    write_json(results.timings, {**(before if isinstance(before, dict) else {}), "control": seconds})
