"""The problems: those of this project, and families in which one bound is tightened."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.rivals.model import Problem
from pipeline.experiments import Experiment
from pipeline.experiments.load import load_experiment
from pipeline.yaml_file import validated

ROOT = Path(__file__).resolve().parents[2]
PARAMS = ROOT / "params.yaml"
_NAMED = ("example1", "example2", "axis", "vehicle", "robot-axis", "tank", "drive-cycle")
TIGHTNESS = (0.04, 0.02, 0.01, 0.005, 0.002)

DOUBLE_INTEGRATOR = {
    "continuous": True,
    "A": [[0, 1], [0, 0]],
    "B": [[0], [1]],
    "states": ["position", "velocity"],
    "inputs": ["acceleration"],
}

# The axis of the guide, as the guide writes it for params.yaml.
_AXIS = {
    "name": "axis",
    "title": "An axis that was moved by hand",
    "samples_from": "data/recordings/axis.csv",
    "samples": {
        "position": {
            "csv": "data/recordings/axis.csv",
            "time_column": "time [ms]",
            "time_unit": "ms",
            "value_column": "position [mm]",
            "decimal": ",",
            "excerpt": {"end": 2.5, "scale": 0.001},
        }
    },
    "system": {**DOUBLE_INTEGRATOR, "sampling_time": 0.01},
    "state_set": {"lower": [-0.10, -0.09], "upper": [0.10, 0.09]},
    "input_set": {"lower": [-0.3], "upper": [0.3]},
    "prior": {"position": {"mean": 0.0, "kernel": {"type": "squared_exponential"}, "noise_std": [0.0001, 0.01]}},
    "claim": "all_times",
    "methods": ["unconstrained", "hyperparameters", "joint"],
    "search": {"starts": 8},
    "verification": {"last_step": 400},
}

# A car that drives off, keeps up with the traffic and stops again: the third hill of the urban cycle.
_DRIVE_CYCLE = {
    "name": "drive-cycle",
    "title": "A hill of the Urban Dynamometer Driving Schedule",
    "samples_from": "benchmarks/rivals/data/udds.csv",
    "samples": {
        "speed": {
            "csv": "benchmarks/rivals/data/udds.csv",
            "time_column": "time [s]",
            "time_unit": "s",
            "value_column": "speed [mph]",
            "excerpt": {"start": 346.0, "end": 400.0, "scale": 0.44704},
        }
    },
    "system": {
        "continuous": True,
        "A": [[0.0]],
        "B": [[1.0]],
        "states": ["speed"],
        "inputs": ["acceleration"],
        "sampling_time": 0.2,
    },
    "state_set": {"lower": [-0.05], "upper": [16.3]},
    "input_set": {"lower": [-1.5], "upper": [1.5]},
    "prior": {"speed": {"mean": 0.0, "kernel": {"type": "squared_exponential"}, "noise_std": [0.01, 1.0]}},
    "claim": {"window": [0.0, 54.0]},
    "methods": ["unconstrained", "hyperparameters", "joint"],
    "search": {"starts": 8},
    "verification": {"last_step": 270},
}
_WRITTEN = {"axis": (_AXIS, "guide"), "drive-cycle": (_DRIVE_CYCLE, "problems")}


def problems() -> Iterator[Problem]:
    """Return all problems, in the order of the table."""
    yield from (problem(name) for name in _NAMED)
    yield from family()


def family() -> Iterator[Problem]:
    """Return Example 1 with the upper bound of the state tightened, from easy to hard."""
    for upper in TIGHTNESS:
        yield Problem(experiment("example1").with_upper_bound(upper), family="tightness", tightness=upper)


@cache
def problem(name: str) -> Problem:
    """Return one of the named problems. KeyError or InputError for another name."""
    found = experiment(name)
    return Problem(found, continuous=_continuous(found))


@cache
def experiment(name: str) -> Experiment:
    """Return the experiment of this name: of params.yaml, or one that is written here."""
    if name in _WRITTEN:
        fields, where = _WRITTEN[name]
        return validated(Experiment, fields, Path(where), "experiments", name)
    return load_experiment(name, PARAMS)


def _continuous(of: Experiment) -> tuple[np.ndarray, np.ndarray] | None:
    written = of.system.fields
    if not written.get("continuous", False):
        return None
    return np.array(written["A"], dtype=float), np.array(written["B"], dtype=float)
