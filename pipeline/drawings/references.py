"""Figures of references whatever they were learned by."""

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from pipeline.drawings import algorithm1, periodic
from pipeline.experiments import Experiment
from pipeline.methods import JOINT, UNCONSTRAINED, methods_in_figures
from pipeline.storage.archive import Fitted, read_margins
from pipeline.storage.results import Results
from trackably import plots
from trackably.certificates.prove import reference_period

_POINTS = 1501


def drawings(experiment: Experiment, results: Results, fitted: Fitted) -> dict[str, Callable[[], Figure]]:
    """Return the figures by name: margins, and states and inputs over time where no figure of the paper shows them."""
    by_name: dict[str, Callable[[], Figure]] = {"margins": lambda: _margins(experiment, results, fitted)}
    if not (algorithm1.applies_to(fitted) or periodic.applies_to(fitted)):
        by_name["tracking"] = lambda: _tracking(experiment, fitted)
    if experiment.plane is not None:
        by_name["path"] = lambda: _path(experiment, fitted)
    if fitted.study and fitted.study.tightness:
        by_name["tightness"] = lambda: _tightness(fitted)
    return by_name


def _margins(experiment: Experiment, results: Results, fitted: Fitted) -> Figure:
    by_method = read_margins(results, fitted.learned)
    shown = {method.name: by_method[method.name] for method in methods_in_figures(by_method)}
    return plots.margins(shown, experiment.units)


def _tightness(fitted: Fitted) -> Figure:
    assert fitted.study, "drawn only where there is one"
    baseline = fitted.learned[UNCONSTRAINED.name]
    (part,) = baseline.prior.parts
    return plots.tightness(fitted.study.tightness, baseline.method, baseline.nlml, float(part.noise_std))


def _path(experiment: Experiment, fitted: Fitted) -> Figure:
    assert experiment.plane is not None, "drawn only where there is one"
    shown = {method.name: fitted.learned[method.name].reference for method in methods_in_figures(fitted.learned)}
    last = experiment.verified(fitted.sampled.samples).last_step * experiment.plant.sampling_time
    period = reference_period(fitted.learned[JOINT.name].reference)
    times = np.linspace(0, last if period is None else min(period, last), _POINTS)
    truths, samples = experiment.truths, fitted.sampled.by_name
    first, second = experiment.plane
    known = (truths[first](times), truths[second](times)) if {first, second} <= truths.keys() else None
    sampled = [samples[name] for name in experiment.plane if name in samples]
    return plots.path(shown, experiment.plane, times, sampled, known, experiment.units)


def _tracking(experiment: Experiment, fitted: Fitted) -> Figure:
    times = np.linspace(
        0, experiment.verified(fitted.sampled.samples).last_step * experiment.plant.sampling_time, _POINTS
    )
    held_out, truths = fitted.sampled.held_out_by_name, experiment.truths
    observed = {
        name: plots.Observed(samples, held_out.get(name), truths[name](times) if name in truths else None)
        for name, samples in fitted.sampled.by_name.items()
    }
    shown = {method.name: fitted.learned[method.name].reference for method in methods_in_figures(fitted.learned)}
    return plots.tracking(shown, observed, times, experiment.units)
