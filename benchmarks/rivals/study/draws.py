"""The runs: seeds × noise × tightness × samples for three systems, numbered from zero."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.rivals.model import Problem
from benchmarks.rivals.problems import DOUBLE_INTEGRATOR
from benchmarks.rivals.study.learners import from_starts
from pipeline.experiments import Experiment
from pipeline.yaml_file import validated

_ENTROPY = 20201104
_RELATIVE_NOISE = (0.005, 0.02, 0.05)  # of the signal's spread
_DENSITIES = 3

LEVELS = ("slack", "touched", "active", "truth outside", "infeasible")
"""How tight a bound is: it holds nothing back; the truth touches it; noise is cut off; the truth itself breaks it; no
trajectory keeps it, as every equilibrium that it allows is outside of another bound."""

Fields = Mapping[str, object]


@dataclass(frozen=True)
class Case:
    """A system with its signal: samples are drawn up to step `last`, every so many steps in `spacings`.

    `upper` is the upper bound that is tightened, one for each of the `LEVELS`; `fields` are the parts of an experiment
    that depend on it. Bounds are judged up to step `until`.
    """

    name: str
    truth: str
    seen: str
    spread: float
    last: int
    spacings: tuple[int, int, int]
    upper: tuple[float, float, float, float, float]
    until: int
    fields: Callable[[float], Fields]


def _example1(upper: float) -> Fields:
    return {
        "system": {"A": [[0.9]], "B": [[0.5]], "states": ["state"], "inputs": ["input"], "sampling_time": 0.01},
        "state_set": {"lower": [-2.0], "upper": [upper]},
        "input_set": {"lower": [-0.3], "upper": [0.3]},
        "claim": {"window": [0.0, 1.2]},
    }


def _example2(upper: float) -> Fields:
    return {
        "system": {"A": [[0.9]], "B": [[0.1]], "states": ["state"], "inputs": ["input"], "sampling_time": 0.01},
        "state_set": {"lower": [-2.0], "upper": [2.0]},
        "input_set": {"lower": [-3.0], "upper": [upper]},
        "claim": "all_phases",
    }


def _two_states(upper: float) -> Fields:
    return {
        "system": {**DOUBLE_INTEGRATOR, "sampling_time": 0.05},
        "state_set": {"lower": [-4.0, -1.2], "upper": [0.5, upper]},
        "input_set": {"lower": [-1.0], "upper": [1.0]},
        "claim": {"window": [0.0, 8.0]},
    }


CASES = (
    Case(
        *("example 1", "setpoint_change", "state", 1.0, 60, (10, 6, 4)),
        upper=(0.3, 0.05, 0.01, -0.02, -1.9),
        until=120,
        fields=_example1,
    ),
    Case(
        *("example 2", "two_harmonics", "state", 2.8, 320, (40, 20, 10)),
        upper=(2.0, 1.0, 0.9, 0.5, -2.05),
        until=320,
        fields=_example2,
    ),
    Case(
        *("two states", "docking_x", "position", 3.0, 120, (20, 12, 8)),
        upper=(1.2, 0.95, 0.9, 0.6, -0.6),
        until=160,
        fields=_two_states,
    ),
)
_SHAPE = (len(CASES), len(_RELATIVE_NOISE), len(LEVELS), _DENSITIES)
COMBINATIONS = math.prod(_SHAPE)


@dataclass(frozen=True)
class Run:
    """One draw: `index` says all; `tightness` and `density` count from 0, slack and sparse."""

    index: int
    case: Case
    noise: float
    tightness: int
    density: int

    @classmethod
    def of(cls, index: int) -> "Run":
        """Return the run of this number: combinations first, then further seeds of each."""
        case, noise, tightness, density = np.unravel_index(index % COMBINATIONS, _SHAPE)
        return cls(index, CASES[int(case)], _RELATIVE_NOISE[int(noise)], int(tightness), int(density))

    @property
    def seed(self) -> int:
        """The seed of its samples, from a child of one SeedSequence: runs do not depend on each other."""
        child = np.random.SeedSequence(_ENTROPY, spawn_key=(self.index,))
        return int(child.generate_state(1)[0])

    @property
    def problem(self) -> Problem:
        """The problem that every rival is given: standard deviations of noise are known, and so is a period."""
        case, noise_std = self.case, self.noise * self.case.spread
        periodic = {"type": "periodic", "period": math.pi}
        kernel = periodic if case.fields is _example2 else {"type": "squared_exponential"}
        source = {
            "ground_truth": case.truth,
            "steps": {"first": 0, "last": case.last, "every": case.spacings[self.density]},
            "noise_std": noise_std,
            "seed": self.seed,
        }
        fields = {
            **case.fields(case.upper[self.tightness]),
            "name": "study",
            "title": case.name,
            "samples_from": "pipeline/published/ground_truth.py",
            "samples": {case.seen: source},
            "prior": {case.seen: {"mean": 0.0, "kernel": kernel, "noise_std": noise_std}},
            "methods": ["unconstrained", "hyperparameters", "joint"],
            "search": {"starts": 4},
            "verification": {"last_step": case.until},
        }
        return Problem(validated(Experiment, fields, Path("study"), "experiments", "study"), search=from_starts)
