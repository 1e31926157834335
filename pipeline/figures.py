"""Stage 5: all results → figures, chosen by what they hold, and what viewers of the logs show beside curves."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from pipeline.drawings import algorithm1, loops, predictions, references, style
from pipeline.drawings.algorithm1 import Landscape, evaluate_on_grid
from pipeline.experiments import Experiment
from pipeline.experiments.load import read_fit_of
from pipeline.loops.trajectory import ON, Disturbed, LoopTrajectory, read_loop_metrics, read_loops
from pipeline.methods import (
    AS_PUBLISHED,
    EXACT,
    HYPERPARAMETERS,
    INTERVALS,
    JOINT,
    ROBUST,
    SOUND,
    UNCONSTRAINED,
    methods_in_figures,
)
from pipeline.published.algorithm1 import SOUND as SOUND_READING
from pipeline.published.periodic import interval_growth_rates
from pipeline.published.scalar import interval_sets
from pipeline.storage.archive import Fitted, read_margins
from pipeline.storage.results import Results, read_columns
from pipeline.viewer.layout import write_scene
from trackably.arrays import Array
from trackably.control.tube import ErrorSet
from trackably.exports import figures as curves
from trackably.gp.joint import JointPrior
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening

Drawings = dict[str, Callable[[], Figure]]


def drawings(experiment: Experiment, results: Results) -> Drawings:
    """Return the figures by name, each drawn when it is called: the stage and the notebook show the same ones."""
    fitted = read_fit_of(experiment, results)
    return {
        **_of_references(experiment, results, fitted),
        **_of_algorithm1(experiment, fitted),
        **_of_periodic(experiment, fitted),
        **_of_loops(experiment, results),
        **_of_disturbed(experiment, results, fitted),
    }


_POINTS = 1501


def _of_references(experiment: Experiment, results: Results, fitted: Fitted) -> dict[str, Callable[[], Figure]]:
    """Return the figures by name: margins, and states and inputs over time where no figure of the paper shows them."""
    by_name: dict[str, Callable[[], Figure]] = {"margins": lambda: _margins(experiment, results, fitted)}
    if not (_has_algorithm1(fitted) or _has_periodic(fitted)):
        by_name["tracking"] = lambda: _tracking(experiment, fitted)
    if experiment.plane is not None:
        by_name["path"] = lambda: _path(experiment, fitted)
    if fitted.study and fitted.study.tightness:
        by_name["tightness"] = lambda: _tightness(fitted)
    return by_name


def _margins(experiment: Experiment, results: Results, fitted: Fitted) -> Figure:
    by_method = read_margins(results, fitted.learned)
    shown = {method.name: by_method[method.name] for method in methods_in_figures(by_method)}
    return references.margins(shown, experiment.units)


def _tightness(fitted: Fitted) -> Figure:
    assert fitted.study, "drawn only where there is one"
    baseline = fitted.learned[UNCONSTRAINED.name]
    (part,) = baseline.prior.parts
    return references.tightness(fitted.study.tightness, baseline.method, baseline.nlml, float(part.noise_std))


def _path(experiment: Experiment, fitted: Fitted) -> Figure:
    assert experiment.plane is not None, "drawn only where there is one"
    shown = {method.name: fitted.learned[method.name].reference for method in methods_in_figures(fitted.learned)}
    last = experiment.verified(fitted.sampled.samples).last_step * experiment.plant.sampling_time
    period = fitted.learned[JOINT.name].reference.period
    times = np.linspace(0, last if period is None else min(period, last), _POINTS)
    truths, samples = experiment.truths, fitted.sampled.by_name
    first, second = experiment.plane
    known = (truths[first](times), truths[second](times)) if {first, second} <= truths.keys() else None
    sampled = [samples[name] for name in experiment.plane if name in samples]
    return references.path(shown, experiment.plane, times, sampled, known, experiment.units)


def _tracking(experiment: Experiment, fitted: Fitted) -> Figure:
    times = np.linspace(
        0, experiment.verified(fitted.sampled.samples).last_step * experiment.plant.sampling_time, _POINTS
    )
    held_out, truths = fitted.sampled.held_out_by_name, experiment.truths
    observed = {
        name: curves.Observed(samples, held_out.get(name), truths[name](times) if name in truths else None)
        for name, samples in fitted.sampled.by_name.items()
    }
    shown = {method.name: fitted.learned[method.name].reference for method in methods_in_figures(fitted.learned)}
    return curves.tracking(shown, observed, times, experiment.units)


_STEPS_OF_TUBE = 12
_GRID_POINTS = 56
_SCHEME, _POINTS_OF_SCHEME = 2.0, 301  # until this multiple of the last sample's time
# The landscape spans these factors around the learned hyperparameters: an overview, and a closer view.
_OVERVIEW, _CLOSER = 8.0, 1.25


def _has_algorithm1(fitted: Fitted) -> bool:
    """Return whether there is a trace of Algorithm 1 in the reading that its proof supports."""
    return SOUND.name in fitted.traces


def _of_algorithm1(experiment: Experiment, fitted: Fitted) -> dict[str, Callable[[], Figure]]:
    """Return the figures by name; none without a trace."""
    if not _has_algorithm1(fitted):
        return {}
    sound = fitted.learned[SOUND.name]
    final_step, plant = sound.final_step or 0, experiment.plant
    shown = _references(fitted)
    (prior,) = sound.prior.parts
    last_sample = round(float(fitted.sampled.only.times[-1]) / plant.sampling_time)
    by_name: dict[str, Callable[[], Figure]] = {
        "scheme": lambda: _scheme(experiment, fitted),
        "tube": lambda: algorithm1.tube(sound.reference, np.arange(_STEPS_OF_TUBE, dtype=float)),
        "asymptotic": lambda: algorithm1.asymptotic(
            sound.reference, fitted.sampled.only, last_sample, final_step, round(1.5 * final_step)
        ),
        "prediction": lambda: _prediction(experiment, fitted, final_step),
    }
    if AS_PUBLISHED.name in fitted.traces:
        trace = fitted.traces[AS_PUBLISHED.name]
        curves = read_columns(experiment.published.iterations) if experiment.published.iterations else None
        by_name["convergence"] = lambda: algorithm1.convergence(trace, interval_sets(plant)[0], prior.mean, curves)
    if len(prior.kernel.hyperparameters.keys() & sound.prior.learned) == 2:
        by_name["landscape"] = lambda: algorithm1.landscape(
            landscapes(experiment, fitted), fitted.traces[SOUND.name], shown
        )
    return by_name


def _scheme(experiment: Experiment, fitted: Fitted) -> Figure:
    (name,) = fitted.sampled.names
    times = np.linspace(0, _SCHEME * float(fitted.sampled.only.times[-1]), _POINTS_OF_SCHEME)
    truth = experiment.truths[name](times) if name in experiment.truths else None
    return algorithm1.scheme(fitted.learned[JOINT.name].reference, fitted.sampled.only, times, truth)


def landscapes(experiment: Experiment, fitted: Fitted) -> Sequence[Landscape]:
    """Return the likelihood and the constraints of the sound reading's last iteration, around what was learned."""
    learned = fitted.learned[SOUND.name]
    (own,) = learned.prior.parts
    kernel = [name for name in own.kernel.hyperparameters if name in own.learned]
    # Where the noise is learned too, the landscape is cut at its learned value.
    prior = replace(own, noise_std=float(own.noise_std))
    space = experiment.search_space(fitted.sampled.samples)
    problem = ConstrainedProblem(
        fitted.sampled.samples,
        JointPrior((prior,)),
        SearchSpace({name: bounds for name, bounds in space.bounds.items() if name in kernel}),
        SOUND_READING.constraints(experiment.plant, learned.final_step or 0),
    )
    first, second = (prior.hyperparameters[name] for name in kernel)
    grids = []
    for factor in (_OVERVIEW, _CLOSER):
        spread = np.geomspace(1 / factor, factor, _GRID_POINTS)
        grids.append(evaluate_on_grid(problem, first * spread, second * spread))
    return grids


def _references(fitted: Fitted) -> dict[str, Reference]:
    shown = methods_in_figures(fitted.learned)
    return {method.name: fitted.learned[method.name].reference for method in shown}


def _prediction(experiment: Experiment, fitted: Fitted, final_step: int) -> Figure:
    steps = np.arange(round(1.5 * final_step) + 1, dtype=float)
    times = steps * experiment.plant.sampling_time
    truth = next((truth(times) for truth in experiment.truths.values()), None)
    return predictions.prediction(
        fitted.sampled.only,
        _references(fitted),
        HYPERPARAMETERS.name,
        steps,
        true_reference=truth,
        published=_published(experiment),
        final_step=final_step,
    )


def _published(experiment: Experiment) -> predictions.Published | None:
    if experiment.published.prediction is None:
        return None
    columns = read_columns(experiment.published.prediction)
    means = {name: columns[f"mean_{name}"] for name in ("unconstrained", "constrained")}
    return predictions.Published(columns["k"], means, columns["successor_lower"], columns["successor_upper"])


_FIRST_STEPS = 50
_CURVE_POINTS = 1001


def _has_periodic(fitted: Fitted) -> bool:
    """Return whether there is a reference that was learned at all phases of its period."""
    return EXACT.name in fitted.learned


def _of_periodic(experiment: Experiment, fitted: Fitted) -> dict[str, Callable[[], Figure]]:
    """Return the figures by name; none without a reference learned at all phases."""
    if not _has_periodic(fitted):
        return {}
    by_name: dict[str, Callable[[], Figure]] = {"prediction": lambda: _periodic_prediction(experiment, fitted)}
    if INTERVALS.name in fitted.learned:
        by_name["growth"] = lambda: predictions.growth_intervals(_growth(experiment, fitted))
    if fitted.study and fitted.study.conservatism.counts.size:
        by_name["conservatism"] = lambda: _conservatism(fitted)
    return by_name


def _curves(fitted: Fitted) -> list[str]:
    return [method.name for method in methods_in_figures(fitted.learned) if method.has_own_curve]


def _last_step(experiment: Experiment, fitted: Fitted) -> int:
    samples = fitted.sampled.samples
    return experiment.periodic.last_step if experiment.periodic else experiment.verified(samples).last_step


def _periodic_prediction(experiment: Experiment, fitted: Fitted) -> Figure:
    steps = np.arange(_last_step(experiment, fitted) + 1, dtype=float)
    times = steps * experiment.plant.sampling_time
    truth = next((truth(times) for truth in experiment.truths.values()), None)
    return predictions.periodic_prediction(
        fitted.sampled.only,
        {method: fitted.learned[method].reference for method in _curves(fitted)},
        HYPERPARAMETERS.name,
        steps,
        _FIRST_STEPS,
        true_reference=truth,
    )


def _growth(experiment: Experiment, fitted: Fitted) -> dict[str, predictions.GrowthIntervals]:
    """Return derivatives in the growth-rate intervals of program (8), and the published ones if there are some."""
    assert experiment.periodic, "the method of these intervals needs it"
    end = experiment.periodic.last_step * experiment.plant.sampling_time
    times, edges = np.linspace(0, end, _CURVE_POINTS), np.linspace(0, end, experiment.periodic.intervals + 1)
    signals = {method: fitted.learned[method].reference.kernel_sums[0] for method in _curves(fitted)}
    rates = interval_growth_rates(signals[INTERVALS.name], experiment.plant, tuple(edges.tolist()))
    derivatives = {method: signal.derivative(times) for method, signal in signals.items()}
    panels = {
        "ours (growth rates: those of the intervals)": predictions.GrowthIntervals(times, derivatives, edges, *rates)
    }
    published = experiment.published
    if published.derivative and published.growth_rates:
        curves, printed = read_columns(published.derivative), read_columns(published.growth_rates)
        panels["published"] = predictions.GrowthIntervals(
            curves["t"],
            {
                "unconstrained": curves["derivative_unconstrained"],
                "constrained (published)": curves["derivative_constrained"],
            },
            np.append(printed["interval_start"], printed["interval_end"][-1]),
            printed["growth_lower"],
            printed["growth_upper"],
        )
    return panels


def _conservatism(fitted: Fitted) -> Figure:
    assert fitted.study, "drawn only where there is one"
    labels = {UNCONSTRAINED.name: UNCONSTRAINED.name, EXACT.name: "exact form, all phases", JOINT.name: JOINT.name}
    levels = {label: fitted.learned[name].objective for name, label in labels.items()}
    return predictions.conservatism(fitted.study.conservatism, levels)


def _of_loops(experiment: Experiment, results: Results) -> dict[str, Callable[[], Figure]]:
    """Return the figures by name, each drawn when it is called. Raises as `read_loops`."""
    plant, wanted, units = experiment.plant, experiment.control, experiment.units
    closed = read_loops(results, plant)
    courses, steps = closed.courses, experiment.loop_steps
    shown = steps.start + min(wanted.shown, wanted.logged, len(steps))
    by_name: dict[str, Callable[[], Figure]] = {
        "closed-loop": lambda: loops.closed_loop(courses, plant, shown, units),
        "cost": lambda: loops.costs(courses, plant, shown),
    }
    if (plane := experiment.plane) is not None:
        by_name["loops-in-plane"] = lambda: loops.loops_in_plane(courses[JOINT.name], plant, plane, shown, units)
    lost = courses[UNCONSTRAINED.name][ON]
    if lost.infeasible.size:
        by_name["infeasibility"] = lambda: loops.infeasibility(lost, plant, wanted.horizon, units)
    online, offered = closed.online, closed.offered
    if online is not None and offered is not None:
        by_name["relearning"] = lambda: loops.relearned(online, offered, plant, units)
    if not closed.feasible:
        return by_name
    if len(plant.system.states) == 1:
        followed = courses[JOINT.name][ON]
        by_name["feasible-set"] = lambda: loops.feasible_intervals(closed.feasible, followed, plant, units)
    else:
        by_name["feasible-set"] = lambda: loops.feasible_polygons(closed.feasible, courses[JOINT.name], plant, units)
    return by_name


_PAIRS = ((JOINT.name, "nominal"), (ROBUST.name, "nominal"), (JOINT.name, "tube"), (ROBUST.name, "tube"))


def _of_disturbed(experiment: Experiment, results: Results, fitted: Fitted) -> dict[str, Callable[[], Figure]]:
    """Return the figures by name; none where nothing was disturbed. Raises as `read_loops`."""
    disturbed, drawn_in = read_loops(results, experiment.plant).disturbed, experiment.tightening
    if disturbed is None or drawn_in is None:
        return {}
    metrics = read_loop_metrics(results)
    price = metrics["price_of_room"]
    return {
        "tube-of-runs": lambda: _tube(experiment, drawn_in, fitted, disturbed, metrics),
        "disturbed-loops": lambda: _disturbed_loops(experiment, disturbed, metrics),
        "price-of-room": lambda: loops.price_of_room(
            price["sizes"], price["price"], price["misfit"], {0.0: JOINT.name, 1.0: ROBUST.name}, _unit(experiment)
        ),
    }


def _unit(experiment: Experiment) -> str | None:
    """Return the unit of all that is sampled, if it is the same one and known."""
    units = {experiment.units.get(name) for name in experiment.samples}
    return units.pop() if len(units) == 1 else None


def _tube(
    experiment: Experiment, drawn_in: Tightening, fitted: Fitted, disturbed: Disturbed, metrics: dict[str, Any]
) -> Figure:
    runs = disturbed.runs
    window = fitted.learned[ROBUST.name].reference.window(int(runs.steps[0]), len(runs.steps))
    count = metrics["disturbed"]["tube"]["runs"]
    return loops.tube_runs(runs, count, window, room(drawn_in), drawn_in.given, experiment.units)


def room(drawn_in: Tightening) -> tuple[Array, Array]:
    """Return how far states and inputs may be below and above a reference, each (n + m,), in float64."""
    Z, K = drawn_in.invariant, drawn_in.invariant.feedback if drawn_in.invariant else None
    assert Z is not None, "drawn only where there is a disturbance"
    assert K is not None, "it belongs to the set"
    rows = np.vstack([np.eye(K.shape[1]), K])
    errors = ErrorSet(Z).support(np.stack([-rows, rows]))
    if (V := drawn_in.noise) is not None:  # x = y − v
        n = K.shape[1]
        errors[0, :n] += V.support(rows[:n])
        errors[1, :n] += V.support(-rows[:n])
    return errors[0], errors[1]


def _disturbed_loops(experiment: Experiment, disturbed: Disturbed, metrics: dict[str, Any]) -> Figure:
    shown: dict[str, dict[str, LoopTrajectory]] = {}
    failures: dict[str, float | None] = {}
    for reference, controller in _PAIRS:
        label = f"{controller} controller,\n{reference} reference"
        shown[label] = dict(disturbed.loops[reference][controller])
        said = metrics["disturbed"][reference][controller].values()
        steps = [of[name] for of in said for name in ("first_step_without_plan", "first_step_outside")]
        failures[label] = min((step for step in steps if step is not None), default=None)
    return loops.disturbed_loops(shown, failures, experiment.plant)


def figures(experiment: Experiment, results: Results) -> None:
    """Draw and save every figure of the experiment, and remove those of an earlier run that it no longer has.

    Scene, events and layout are written too, for viewers of the logs.
    """
    drawn = drawings(experiment, results)
    for name, draw in tqdm(drawn.items(), desc=f"{experiment.name}: figures", disable=None):
        style.save(draw(), results.figure(name))
    for old in {*results.figures.glob("*.svg")} - {results.figure(name) for name in drawn}:
        old.unlink()
    write_scene(experiment, results)
