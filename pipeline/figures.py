"""Stage 5: all of the above → figures; which ones depends on the kind of experiment."""

from collections.abc import Callable

from matplotlib.figure import Figure
from tqdm import tqdm

from pipeline import figures_asymptotic, figures_control, figures_periodic, figures_tracking
from pipeline.experiments import AsymptoticExperiment, Experiment, PeriodicExperiment, TrackingExperiment
from pipeline.storage.results import Results
from trackable import plots


def figures(experiment: Experiment, results: Results) -> None:
    """Draw and save every figure of the experiment; those of an earlier run that it has no more are removed."""
    drawn = drawings(experiment, results)
    for name, draw in tqdm(drawn.items(), desc=f"{experiment.name}: figures", disable=None):
        plots.save(draw(), results.figure(name))
    for old in {*results.figures.glob("*.svg")} - {results.figure(name) for name in drawn}:
        old.unlink()


def drawings(experiment: Experiment, results: Results) -> dict[str, Callable[[], Figure]]:
    """The figures of an experiment by name, each drawn when it is called: here and in the notebook the same."""
    return {**_of_references(experiment, results), **figures_control.drawings(experiment, results)}


def _of_references(experiment: Experiment, results: Results) -> dict[str, Callable[[], Figure]]:
    match experiment:
        case AsymptoticExperiment():
            return figures_asymptotic.drawings(experiment, results)
        case PeriodicExperiment():
            return figures_periodic.drawings(experiment, results)
        case TrackingExperiment():
            return figures_tracking.drawings(experiment, results)
    raise TypeError(f"no figures of a {type(experiment).__name__}")
