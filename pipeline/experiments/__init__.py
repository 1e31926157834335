"""params.yaml → frozen, validated experiments. Everything is checked here, once, before anything is computed."""

from pipeline.experiments.load import PARAMS, load_experiment, load_experiments
from pipeline.experiments.model import AsymptoticExperiment, Experiment, PeriodicExperiment, ScalarExperiment
from pipeline.experiments.tracking import TrackingExperiment

__all__ = [
    "PARAMS",
    "AsymptoticExperiment",
    "Experiment",
    "PeriodicExperiment",
    "ScalarExperiment",
    "TrackingExperiment",
    "load_experiment",
    "load_experiments",
]
