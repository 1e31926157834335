"""The runs: seeds × noise × tightness × samples for three systems, numbered from zero."""

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.rivals.model import Problem
from benchmarks.rivals.study.learners import from_starts
from pipeline.experiments import Experiment
from pipeline.storage.yaml_file import validated

_ENTROPY = 20201104
_RELATIVE_NOISE = (0.005, 0.02, 0.05)  # of the signal's spread
_COMMON = {
    "samples_from": "pipeline/published/ground_truth.py",
    "methods": ["unconstrained", "hyperparameters", "joint"],
}


@dataclass(frozen=True)
class Case:
    """A system with its signal: samples are drawn up to step `last`, every so many steps in `spacings`.

    `upper` are upper bounds of the state or input that is drawn in, from easy to hard.
    """

    name: str
    truth: str
    state: str
    spread: float
    last: int
    spacings: tuple[int, ...]
    upper: tuple[float, ...]


CASES = (
    Case("example 1", "setpoint_change", "state", 1.0, 60, (10, 6, 4), (0.05, 0.01, 0.003)),
    Case("example 2", "two_harmonics", "state", 2.8, 320, (40, 20, 10), (2.0, 1.4, 1.2)),
    Case("two states", "docking_x", "position", 3.0, 120, (20, 12, 8), (0.95, 0.85, 0.75)),
)
COMBINATIONS = len(CASES) * len(_RELATIVE_NOISE) * 3 * 3


@dataclass(frozen=True)
class Run:
    """One draw: `index` says all; `tightness` and `density` count from 0, easy and sparse."""

    index: int
    case: Case
    noise: float
    tightness: int
    density: int

    @classmethod
    def of(cls, index: int) -> "Run":
        """Return the run of this number: combinations first, then further seeds of each."""
        case, noise, tightness, density = np.unravel_index(
            index % COMBINATIONS, (len(CASES), len(_RELATIVE_NOISE), 3, 3)
        )
        return cls(index, CASES[int(case)], _RELATIVE_NOISE[int(noise)], int(tightness), int(density))

    @property
    def seed(self) -> int:
        """The seed of its samples, from a child of one SeedSequence: runs do not depend on each other."""
        child = np.random.SeedSequence(_ENTROPY, spawn_key=(self.index,))
        return int(child.generate_state(1)[0])

    @property
    def problem(self) -> Problem:
        """The problem that every rival is given."""
        return Problem(_experiment(self), search=from_starts)


def _experiment(run: Run) -> Experiment:
    case, noise_std = run.case, run.noise * run.case.spread
    source = {
        "ground_truth": case.truth,
        "steps": {"first": 0, "last": case.last, "every": case.spacings[run.density]},
        "noise_std": noise_std,
        "seed": run.seed,
    }
    fields = {
        **_COMMON,
        "name": "study",
        "title": case.name,
        "samples": {case.state: source},
        **_SYSTEMS[case.name](case.upper[run.tightness]),
    }
    fields["prior"] = {case.state: {"mean": 0.0, "kernel": fields.pop("kernel"), "noise_std": noise_std}}
    return _validated(repr(fields), fields)


def _validated(_: str, fields: dict[str, object]) -> Experiment:
    return validated(Experiment, fields, Path("study"), "experiments", "study")


def _example1(upper: float) -> dict[str, object]:
    return {
        "system": {"A": [[0.9]], "B": [[0.5]], "states": ["state"], "inputs": ["input"], "sampling_time": 0.01},
        "state_set": {"lower": [-2.0], "upper": [upper]},
        "input_set": {"lower": [-0.5], "upper": [0.5]},
        "kernel": {"type": "squared_exponential"},
        "claim": {"window": [0.0, 1.2]},
        "search": {"starts": 4},
        "verification": {"last_step": 120},
    }


def _example2(upper: float) -> dict[str, object]:
    return {
        "system": {"A": [[0.9]], "B": [[0.1]], "states": ["state"], "inputs": ["input"], "sampling_time": 0.01},
        "state_set": {"lower": [-2.0], "upper": [2.0]},
        "input_set": {"lower": [-3.0], "upper": [upper]},
        "kernel": {"type": "periodic", "period": math.pi},
        "claim": "all_phases",
        "search": {"starts": 4},
        "verification": {"last_step": 320},
    }


def _two_states(upper: float) -> dict[str, object]:
    return {
        "system": {
            "continuous": True,
            "A": [[0, 1], [0, 0]],
            "B": [[0], [1]],
            "states": ["position", "velocity"],
            "inputs": ["acceleration"],
            "sampling_time": 0.05,
        },
        "state_set": {"lower": [-4.0, -upper], "upper": [0.05, upper]},
        "input_set": {"lower": [-1.0], "upper": [1.0]},
        "kernel": {"type": "squared_exponential"},
        "claim": {"window": [0.0, 8.0]},
        "search": {"starts": 4},
        "verification": {"last_step": 160},
    }


_SYSTEMS = {case.name: system for case, system in zip(CASES, (_example1, _example2, _two_states), strict=True)}


@cache
def combinations() -> tuple[Run, ...]:
    """Return the first run of each combination."""
    return tuple(Run.of(index) for index in range(COMBINATIONS))
