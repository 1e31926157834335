"""params.yaml → frozen, validated experiments. Everything is checked here, once, before anything is computed."""

from pipeline.experiments.load import PARAMS, load_experiment, load_experiments
from pipeline.experiments.model import AsymptoticExperiment, Experiment, PeriodicExperiment

__all__ = [
    "PARAMS",
    "AsymptoticExperiment",
    "Experiment",
    "PeriodicExperiment",
    "load_experiment",
    "load_experiments",
]
