"""The problems: those of this project, and families in which one bound is tightened."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

from benchmarks.rivals.model import Problem
from pipeline.experiments import Experiment
from pipeline.experiments.load import load_experiment

ROOT = Path(__file__).resolve().parents[2]
PARAMS, WRITTEN = ROOT / "params.yaml", Path(__file__).with_name("params.yaml")
_WRITTEN = ("axis", "drive-cycle")
_NAMED = ("example1", "example2", "axis", "vehicle", "robot-axis", "tank", "drive-cycle")
TIGHTNESS = (0.04, 0.02, 0.01, 0.005, 0.002)


def problems() -> Iterator[Problem]:
    """Return all problems, in the order of the table."""
    yield from (problem(name) for name in _NAMED)
    yield from family()


def family() -> Iterator[Problem]:
    """Return Example 1 with the upper bound of the state tightened, from easy to hard."""
    for upper in TIGHTNESS:
        yield Problem(experiment("example1").with_upper_bound(upper), tightness=upper)


@cache
def problem(name: str) -> Problem:
    """Return one of the named problems. KeyError or InputError for another name."""
    return Problem(experiment(name))


@cache
def experiment(name: str) -> Experiment:
    """Return the experiment of this name: of the project's params.yaml, or of the one beside this file."""
    return load_experiment(name, WRITTEN if name in _WRITTEN else PARAMS)
