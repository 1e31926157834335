"""Figures of periodic references of scalar systems."""

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from pipeline.experiments import Experiment
from pipeline.methods import EXACT, HYPERPARAMETERS, INTERVALS, JOINT, UNCONSTRAINED, methods_in_figures
from pipeline.storage.archive import Fitted
from pipeline.storage.tables import read_columns
from trackably import plots
from trackably.learning.published.growth import interval_growth_rates

_FIRST_STEPS = 50
_POINTS = 1001


def applies_to(fitted: Fitted) -> bool:
    """Return whether there is a reference that was learned at all phases of its period."""
    return EXACT.name in fitted.learned


def drawings(experiment: Experiment, fitted: Fitted) -> dict[str, Callable[[], Figure]]:
    """Return the figures by name; none without a reference learned at all phases."""
    if not applies_to(fitted):
        return {}
    by_name: dict[str, Callable[[], Figure]] = {"prediction": lambda: _prediction(experiment, fitted)}
    if INTERVALS.name in fitted.learned:
        by_name["growth"] = lambda: plots.growth_intervals(_growth(experiment, fitted))
    if fitted.study and fitted.study.conservatism.counts.size:
        by_name["conservatism"] = lambda: _conservatism(fitted)
    return by_name


def _curves(fitted: Fitted) -> list[str]:
    return [method.name for method in methods_in_figures(fitted.learned) if method.has_own_curve]


def _last_step(experiment: Experiment, fitted: Fitted) -> int:
    samples = fitted.sampled.samples
    return experiment.periodic.last_step if experiment.periodic else experiment.verified(samples).last_step


def _prediction(experiment: Experiment, fitted: Fitted) -> Figure:
    steps = np.arange(_last_step(experiment, fitted) + 1, dtype=float)
    times = steps * experiment.plant.sampling_time
    truth = next((truth(times) for truth in experiment.truths.values()), None)
    return plots.periodic_prediction(
        fitted.sampled.only,
        {method: fitted.learned[method].reference for method in _curves(fitted)},
        HYPERPARAMETERS.name,
        steps,
        _FIRST_STEPS,
        true_reference=truth,
    )


def _growth(experiment: Experiment, fitted: Fitted) -> dict[str, plots.GrowthIntervals]:
    """Return derivatives in the growth-rate intervals of program (8), and the published ones if there are some."""
    assert experiment.periodic, "the method of these intervals needs it"
    end = experiment.periodic.last_step * experiment.plant.sampling_time
    times, edges = np.linspace(0, end, _POINTS), np.linspace(0, end, experiment.periodic.intervals + 1)
    signals = {method: fitted.learned[method].reference.kernel_sums[0] for method in _curves(fitted)}
    rates = interval_growth_rates(signals[INTERVALS.name], experiment.plant, tuple(edges.tolist()))
    derivatives = {method: signal.derivative(times) for method, signal in signals.items()}
    panels = {"ours (growth rates: those of the intervals)": plots.GrowthIntervals(times, derivatives, edges, *rates)}
    published = experiment.published
    if published.derivative and published.growth_rates:
        curves, printed = read_columns(published.derivative), read_columns(published.growth_rates)
        panels["published"] = plots.GrowthIntervals(
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
    return plots.conservatism(fitted.study.conservatism, levels)
