"""Figures of systems with several states and inputs."""

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from pipeline.experiments import TrackingExperiment
from pipeline.storage.archive import Fitted, read_fit, read_margins
from pipeline.storage.results import Results
from trackable import plots

_POINTS = 1501


def drawings(experiment: TrackingExperiment, results: Results) -> dict[str, Callable[[], Figure]]:
    """The figures by name, each drawn when it is called."""
    fitted = read_fit(results)
    return {
        "tracking": lambda: _tracking(experiment, fitted),
        "margins": lambda: plots.margins(read_margins(results, fitted.learned)),
    }


def _tracking(experiment: TrackingExperiment, fitted: Fitted) -> Figure:
    times = np.linspace(0, experiment.last_step * experiment.system.sampling_time, _POINTS)
    held_out, truths = fitted.sampled.held_out_by_name, experiment.truths
    observed = {
        name: plots.Observed(samples, held_out.get(name), truths[name](times) if name in truths else None)
        for name, samples in fitted.sampled.by_name.items()
    }
    return plots.tracking({name: learned.reference for name, learned in fitted.learned.items()}, observed, times)
