"""Figures of disturbed loops."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pipeline.experiments import Experiment
from pipeline.methods import JOINT, ROBUST
from pipeline.storage.archive import Fitted
from pipeline.storage.disturbed import Disturbed
from pipeline.storage.loops import read_loop_metrics, read_loops
from pipeline.storage.results import Results
from trackably import plots
from trackably.arrays import Array
from trackably.control.loop_trajectory import LoopTrajectory
from trackably.systems.disturbance.tightening import Tightening

_PAIRS = ((JOINT.name, "nominal"), (ROBUST.name, "nominal"), (JOINT.name, "tube"), (ROBUST.name, "tube"))


def drawings(experiment: Experiment, results: Results, fitted: Fitted) -> dict[str, Callable[[], Figure]]:
    """Return the figures by name; none where nothing was disturbed. Raises as `read_loops`."""
    disturbed, drawn_in = read_loops(results, experiment.plant).disturbed, experiment.tightening
    if disturbed is None or drawn_in is None:
        return {}
    metrics = read_loop_metrics(results)
    price = metrics["price_of_room"]
    return {
        "tube-of-runs": lambda: _tube(experiment, drawn_in, fitted, disturbed, metrics),
        "disturbed-loops": lambda: _loops(experiment, disturbed, metrics),
        "price-of-room": lambda: plots.price_of_room(
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
    return plots.tube_runs(runs, count, window, room(drawn_in), drawn_in.given, experiment.units)


def room(drawn_in: Tightening) -> tuple[Array, Array]:
    """Return how far states and inputs may be below and above a reference, each (n + m,), in float64."""
    Z, K = drawn_in.invariant, drawn_in.invariant.feedback if drawn_in.invariant else None
    assert Z is not None, "drawn only where there is a disturbance"
    assert K is not None, "it belongs to the set"
    rows = np.vstack([np.eye(K.shape[1]), K])
    errors = Z.approximate_support(np.stack([-rows, rows]))
    if (V := drawn_in.noise) is not None:  # x = y − v
        n = K.shape[1]
        errors[0, :n] += V.support(rows[:n])
        errors[1, :n] += V.support(-rows[:n])
    return errors[0], errors[1]


def _loops(experiment: Experiment, disturbed: Disturbed, metrics: dict[str, Any]) -> Figure:
    loops: dict[str, dict[str, LoopTrajectory]] = {}
    failures: dict[str, float | None] = {}
    for reference, controller in _PAIRS:
        label = f"{controller} controller,\n{reference} reference"
        loops[label] = dict(disturbed.loops[reference][controller])
        said = metrics["disturbed"][reference][controller].values()
        steps = [of[name] for of in said for name in ("first_step_without_plan", "first_step_outside")]
        failures[label] = min((step for step in steps if step is not None), default=None)
    return plots.disturbed_loops(loops, failures, experiment.plant)
