"""The figures of an experiment, chosen by what its results hold."""

from collections.abc import Callable

from matplotlib.figure import Figure

from pipeline.drawings import algorithm1, disturbed, loops, periodic, references
from pipeline.experiments import Experiment
from pipeline.experiments.fitted import read_fit_of
from pipeline.storage.results import Results

Drawings = dict[str, Callable[[], Figure]]


def drawings(experiment: Experiment, results: Results) -> Drawings:
    """Return the figures by name, each drawn when it is called: the stage and the notebook show the same ones."""
    fitted = read_fit_of(experiment, results)
    return {
        **references.drawings(experiment, results, fitted),
        **algorithm1.drawings(experiment, fitted),
        **periodic.drawings(experiment, fitted),
        **loops.drawings(experiment, results),
        **disturbed.drawings(experiment, results, fitted),
    }
