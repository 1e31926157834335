"""Figures of a periodic reference."""

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from pipeline.experiments import PeriodicExperiment
from pipeline.published.ground_truth import GROUND_TRUTHS
from pipeline.storage.archive import Fitted, read_fit, read_margins
from pipeline.storage.results import Results
from pipeline.storage.tables import read_columns
from trackable import plots
from trackable.learning.published.growth import interval_growth_rates
from trackable.systems.margins import MarginProfile

# Looks go by position: in this order the references of every figure.
_ORDER = ("unconstrained", "exact", "intervals", "grid", "sampled")
_CURVES = _ORDER[:3]  # the others cannot be told from `exact` by eye
_FIRST_STEPS = 50
_POINTS = 1001


def drawings(experiment: PeriodicExperiment, results: Results) -> dict[str, Callable[[], Figure]]:
    """The figures by name, each drawn when it is called."""
    fitted = read_fit(results)
    by_name: dict[str, Callable[[], Figure]] = {
        "prediction": lambda: _prediction(experiment, fitted),
        "growth": lambda: plots.growth_intervals(_growth(experiment, fitted)),
        "margins": lambda: plots.margins(_ordered(read_margins(results, fitted.learned))),
    }
    if fitted.study and fitted.study.conservatism.counts.size:
        by_name["conservatism"] = lambda: _conservatism(fitted)
    return by_name


def _ordered(by_method: dict[str, list[MarginProfile]]) -> dict[str, list[MarginProfile]]:
    return {method: by_method[method] for method in _ORDER if method in by_method}


def _prediction(experiment: PeriodicExperiment, fitted: Fitted) -> Figure:
    steps = np.arange(experiment.periodic.last_step + 1, dtype=float)
    truth = GROUND_TRUTHS.get(experiment.ground_truth or "")
    return plots.periodic_prediction(
        fitted.sampled.only,
        {method: fitted.learned[method].reference for method in _CURVES},
        "exact",
        steps,
        _FIRST_STEPS,
        true_reference=truth(steps * experiment.system.sampling_time) if truth else None,
    )


def _growth(experiment: PeriodicExperiment, fitted: Fitted) -> dict[str, plots.GrowthIntervals]:
    """Derivatives in the growth-rate intervals of program (9): ours, and the published ones where there are some."""
    wanted = experiment.periodic
    end = wanted.last_step * experiment.system.sampling_time
    times, edges = np.linspace(0, end, _POINTS), np.linspace(0, end, wanted.intervals + 1)
    signals = {method: fitted.learned[method].reference.signals[0] for method in _CURVES}
    rates = interval_growth_rates(signals["intervals"], experiment.constrained_system, tuple(edges.tolist()))
    derivatives = {method: signal.derivative(times) for method, signal in signals.items()}
    panels = {"ours (growth rates: those of the intervals)": plots.GrowthIntervals(times, derivatives, edges, *rates)}
    if experiment.published_derivative and experiment.published_growth_rates:
        curves, printed = (
            read_columns(p) for p in (experiment.published_derivative, experiment.published_growth_rates)
        )
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
    assert fitted.study
    learned = fitted.learned
    return plots.conservatism(fitted.study.conservatism, learned["exact"].objective, learned["unconstrained"].objective)
