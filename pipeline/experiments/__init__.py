"""params.yaml → frozen, validated experiments. All entries are checked here, once, before anything is computed."""

from pipeline.experiments.load import PARAMS, load_experiment, load_experiments, parameters_of
from pipeline.experiments.model import Experiment

__all__ = ["PARAMS", "Experiment", "load_experiment", "load_experiments", "parameters_of"]
