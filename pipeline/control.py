"""Stage 4: references → closed loops and their metrics, and references that are learned again while a loop runs."""

from contextlib import suppress
from dataclasses import asdict

import numpy as np
from tqdm import tqdm

from pipeline.experiments import Experiment
from pipeline.experiments.model import with_learned_means
from pipeline.loops.disturbed import disturbed_loops, prices
from pipeline.loops.online import relearn
from pipeline.loops.trajectory import (
    LOGGED,
    ON,
    Course,
    first_untrackable_step,
    initial_states,
    loop_metrics,
    write_loops,
)
from pipeline.methods import HYPERPARAMETERS, JOINT, ROBUST, UNCONSTRAINED, Fit
from pipeline.storage.archive import Fitted, Sampled, read_fit
from pipeline.storage.results import Results
from pipeline.verify import errors_of
from trackably.certificates.claim import times_of
from trackably.control.controller import Controller
from trackably.control.references import TrackedReference
from trackably.control.simulation import apply_fallback_for, simulate
from trackably.errors import InputError
from trackably.files import write_json
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencil
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference


def interpolated(samples: tuple[Samples, ...], plant: ConstrainedSystem) -> Reference:
    """Return straight lines between samples of the flat outputs, constant before the first sample and after the last.

    Nothing is learned: this is what a controller would track without learning. The inputs follow by flatness, so that
    the system tracks the lines exactly if the inputs are admissible; the inputs jump at the corners. Samples may
    measure a flat output z through a stencil, y(t) = offset + Σ_j w_j z(t + j T_s). The lines are then those of which
    the samples are measurements, except near corners: on a straight line Σ_j w_j z(t + j T_s) = W z(t + τ) with
    W = Σ_j w_j and τ = Σ_j w_j j T_s / W. Raises ValueError if a stencil measures changes only (W = 0).
    """
    lines = []
    for of in (each.of_level for each in samples):
        weights = np.array(of.stencil.weights if isinstance(of.stencil, Stencil) else [0.0])
        total = float(np.sum(weights))
        if abs(total) <= 1e-9 * float(np.sum(np.abs(weights))):
            raise ValueError("reference: expected samples of a flat output's values, got samples of its changes only")
        times = of.times + float(weights @ np.arange(len(weights))) / total * of.stencil.step
        values = (of.values - of.stencil.offset) / total
        lines.append(PolynomialPieces.lines(dict(zip(times.tolist(), values.tolist(), strict=True))))
    return Reference(tuple(lines), plant)


INTERPOLATED = "interpolated"
_COLUMNS = ("uppers", "objectives", "misfits", "errors")


def tightness(experiment: Experiment, sampled: Sampled) -> dict[str, dict[str, list[float]]]:
    """Return by method, for each of other upper bounds of the state, J and two errors of its proved reference.

    These are the root mean square distances to the samples and to the true signal. Bounds for which no reference is
    proved are left out.
    """
    tried = [(method, upper) for method in (HYPERPARAMETERS, JOINT) for upper in experiment.tightness]
    found: dict[str, dict[str, list[float]]] = {of.name: {name: [] for name in _COLUMNS} for of, _ in tried}
    for method, upper in tqdm(tried, desc=f"{experiment.name}: tightness", disable=None if tried else True):
        task = experiment.with_upper_bound(upper).task(sampled.samples)
        fit = method.learn(task)
        if isinstance(fit, Fit):
            errors = errors_of(experiment, sampled, Reference(fit.solution.signals, task.plant))
            row = (upper, fit.solution.objective, errors["misfit"], errors["rmse"])
            for column, value in zip(found[method.name].values(), row, strict=True):
                column.append(value)
    return found


def control(experiment: Experiment, results: Results) -> None:
    """Write the closed loops on every reference, and their metrics.

    The loops run at steps for which the certified reference is proved. Raises InputError if no controller exists, or
    if a window is too short for one.
    """
    fitted, wanted, plant = read_fit(results), experiment.control, experiment.plant
    experiment = with_learned_means(experiment, fitted.sampled.samples)
    try:
        controller = Controller(plant, wanted.horizon)
    except ValueError as error:
        raise InputError(f"experiment {experiment.name}: control: {error}") from error
    steps = experiment.loop_steps
    if not steps:
        raise InputError(
            f"experiment {experiment.name}: control: the window that is proved must be longer than the horizon, "
            f"{wanted.horizon} steps, got {times_of(experiment.claim)}"
        )
    references = references_of(fitted)
    started = initial_states(controller, references[JOINT.name], steps.start)
    metrics: dict[str, object] = {"horizon": wanted.horizon}
    courses: dict[str, Course] = {}
    for name, reference in references.items():
        found = {}
        # The initial state `on` lies on this reference; the other ones are chosen for the certified reference.
        states = started | {ON: reference.window(steps.start, 1).states[0]}
        for start, state in tqdm(states.items(), desc=f"{experiment.name}: {name}", disable=None):
            policy = apply_fallback_for(wanted.patience)
            loop = simulate(controller, reference, state, len(steps), first_step=steps.start, on_infeasible=policy)
            courses[f"/loops/{name}/{start}"] = Course.of(loop, plant).until(steps.start + LOGGED)
            found[start] = loop_metrics(loop, plant)
        metrics[name] = {"first_untrackable_step": first_untrackable_step(reference, plant, steps), **found}
    online = relearn(experiment, fitted.sampled, controller)
    if online:
        metrics["online"] = {
            **loop_metrics(online.loop, plant),
            "offers": [asdict(update) for update in online.updates],
        }
        courses |= {"/online": Course.of(online.loop, plant), "/offers": online.offers}
    if experiment.tightness:
        metrics["tightness"] = tightness(experiment, fitted.sampled)
    if experiment.disturbance:
        followed = {name: fitted.learned[name].reference for name in (JOINT.name, ROBUST.name)}
        disturbed, metrics["disturbed"] = disturbed_loops(experiment, followed)
        metrics["price_of_room"] = prices(experiment, fitted)
        courses |= disturbed
    write_loops(results, plant, courses, metrics)
    write_json(results.control, metrics)


def references_of(fitted: Fitted) -> dict[str, TrackedReference]:
    """Return what the controller follows: the proved reference `joint`, the unconstrained mean, and straight lines.

    The lines connect the samples. There are none for samples that show only changes of a flat output.
    """
    joint = fitted.learned[JOINT.name].reference
    unconstrained = fitted.learned[UNCONSTRAINED.name].reference
    found: dict[str, TrackedReference] = {JOINT.name: joint, UNCONSTRAINED.name: unconstrained}
    with suppress(ValueError):  # there are no lines if samples show only changes of a flat output
        found[INTERPOLATED] = interpolated(fitted.sampled.samples, joint.plant)
    return found
