"""The runs: seeds × noise × tightness × samples for three systems, numbered from zero."""

import math
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.rivals.model import Problem
from pipeline.experiments import Experiment
from pipeline.yaml_file import validated
from trackably.files import read_yaml

_ENTROPY = 20201104
_RELATIVE_NOISE = (0.005, 0.02, 0.05)  # of the signal's spread
_DENSITIES = 3

LEVELS = ("slack", "touched", "active", "truth outside", "infeasible")
"""How tight a bound is: it holds nothing back; the truth touches it; noise is cut off; the truth itself breaks it; no
trajectory keeps it, as every equilibrium that it allows is outside of another bound."""

_WRITTEN = Path(__file__).with_name("params.yaml")


@dataclass(frozen=True)
class Case:
    """An experiment of params.yaml, called `name` in tables: samples are drawn every so many steps in `spacings`.

    `upper` is the last upper bound of `tightened`, a set, for each of the `LEVELS`. Values of the signal differ by
    `spread`, in which noise is relative.
    """

    name: str
    experiment: str
    tightened: str
    upper: tuple[float, float, float, float, float]
    spread: float
    spacings: tuple[int, int, int]


CASES = (
    Case("example 1", "example1", "state_set", (0.3, 0.05, 0.01, -0.02, -1.9), 1.0, (10, 6, 4)),
    Case("example 2", "example2", "input_set", (2.0, 1.0, 0.9, 0.5, -2.05), 2.8, (40, 20, 10)),
    Case("two states", "two-states", "state_set", (1.2, 0.95, 0.9, 0.6, -0.6), 3.0, (20, 12, 8)),
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
        fields = deepcopy(_experiments()[case.experiment])
        (source,), (prior,) = fields["samples"].values(), fields["prior"].values()
        source |= {"noise_std": noise_std, "seed": self.seed}
        source["steps"]["every"] = case.spacings[self.density]
        prior["noise_std"] = noise_std
        fields[case.tightened]["upper"][-1] = case.upper[self.tightness]
        found = validated(Experiment, {**fields, "name": "study"}, _WRITTEN, "experiments", case.experiment)
        return Problem(found)


@cache
def _experiments() -> dict[str, Any]:
    written: Any = read_yaml(_WRITTEN)
    return dict(written["experiments"])
