"""Small parts of an experiment as written in params.yaml."""

import math
import re
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    NonNegativeInt,
    PlainValidator,
    PositiveFloat,
    PositiveInt,
    model_validator,
)

from pipeline.experiments.kernel_choice import parse_hyperparameter, parse_kernel
from pipeline.published.ground_truth import GROUND_TRUTHS
from pipeline.storage.yaml_file import Fields
from trackably.arguments import is_number
from trackably.arrays import Array
from trackably.condensed.asked import Centres
from trackably.condensed.bins import NODES
from trackably.gp.hyperparameter import hyperparameter
from trackably.gp.kernels.base import Kernel
from trackably.gp.prior import Prior
from trackably.learning.space import MOST_STARTS


def as_tuple(written: object) -> object:
    """Return a list as the tuple that a frozen field holds, and anything else as it is."""
    return tuple(written) if isinstance(written, list) else written


def by_name(written: object) -> object:
    """Return a mapping that has entries as it is. ValueError: anything else."""
    if not isinstance(written, dict) or not written:
        raise ValueError("expected a mapping from the name of what is sampled")
    return written


def as_set(written: object) -> object:
    """Return a list as the set that a frozen field holds, and anything else as it is."""
    return frozenset(written) if isinstance(written, list) else written


def _centres(written: object) -> object:
    is_count = isinstance(written, int) and not isinstance(written, bool) and written >= NODES
    if written is None or written == "auto" or is_count:
        return written
    raise ValueError(
        f"expected auto, a whole number from {NODES} on, or null to learn from each sample, got {written!r}"
    )


def _known_truth(name: str) -> str:
    if name not in GROUND_TRUTHS:
        raise ValueError(f"expected one of {', '.join(GROUND_TRUTHS)}, got {name!r}")
    return name


def _plain_unit(unit: str) -> str:
    if not re.fullmatch(r"(?:[^\W_]|[°%])[\w·/*^°%²³⁻¹–-]{0,19}|–", unit):
        raise ValueError(f"expected a unit such as mm, m/s² or –, got {unit!r:.60}")
    return unit


ProjectPath = Annotated[Path, BeforeValidator(lambda written: Path(written) if isinstance(written, str) else written)]
CentresField = Annotated[Centres, PlainValidator(_centres)]
GroundTruthName = Annotated[str, AfterValidator(_known_truth)]
UnitField = Annotated[str, AfterValidator(_plain_unit)]
MOST_STEPS = 1_000_000
StepCount = Annotated[PositiveInt, Field(le=MOST_STEPS)]
"""More sampling steps would take days, and their logs more room than there is."""
Counts = Annotated[tuple[PositiveInt, ...], BeforeValidator(as_tuple)]


class Steps(Fields):
    """The sampling steps first, first + every, … up to last."""

    first: NonNegativeInt
    last: StepCount
    every: PositiveInt

    @model_validator(mode="after")
    def _ordered(self) -> "Steps":
        if self.last < self.first:
            raise ValueError(f"expected first ≤ last, got first = {self.first}, last = {self.last}")
        return self

    def times(self, sampling_time: float) -> Array:
        """Return the times [s] of these steps."""
        return np.arange(self.first, self.last + 1, self.every, dtype=float) * sampling_time


def _mean(written: Any) -> object:
    ends = written if isinstance(written, list) else [written]
    if all(is_number(end) and math.isfinite(end) for end in ends):
        match written:
            case [lower, upper] if lower < upper:
                return float(lower), float(upper)
            case int() | float():
                return float(written)
    raise ValueError("expected a number (known) or [lower, upper] with lower < upper (learned)")


class PriorFields(Fields):
    """The prior mean, the kernel, and the noise; hyperparameters and the mean are known or learned in an interval.

    Hyperparameters that are left out, noise_std among them, are learned in an interval chosen from the samples.
    """

    mean: Annotated[float | tuple[float, float], BeforeValidator(_mean)]
    kernel: Annotated[Kernel, PlainValidator(parse_kernel)]
    noise_std: Annotated[float, PlainValidator(parse_hyperparameter)] = hyperparameter(None)

    @property
    def prior(self) -> Prior:
        """The prior of what is sampled; a mean that is to be learned is in the middle of its interval."""
        mean = sum(self.mean) / 2 if isinstance(self.mean, tuple) else self.mean
        return Prior(self.kernel, self.noise_std, mean)


class NoiseFields(Fields):
    """The noise of what is sampled beside another state that shows the same flat output, and has its prior."""

    noise_std: PositiveFloat


def _which_prior(written: object) -> object:
    alone = isinstance(written, dict) and not {"mean", "kernel"} & written.keys()
    return (NoiseFields if alone else PriorFields).model_validate(written)


PriorField = Annotated[PriorFields | NoiseFields, BeforeValidator(_which_prior)]


class Search(Fields):
    """From how many points the search starts."""

    starts: Annotated[PositiveInt, Field(le=MOST_STARTS)] = 8


class Verification(Fields):
    """Compute margins up to step `last_step`, at `instants_per_step` times in each sampling interval."""

    last_step: StepCount
    instants_per_step: PositiveInt = 1


class StudyFields(Fields):
    """Solve program (8) with each η of `conservatism`, and learn from samples that the first `draws` seeds give.

    `tightness` are upper bounds of the state: references are learned for each of them too.
    """

    conservatism: Counts = ()
    draws: NonNegativeInt = 0
    tightness: Annotated[tuple[float, ...], BeforeValidator(as_tuple)] = ()


class Published(Fields):
    """Files with curves that the paper prints, for figures that show them beside ours."""

    prediction: ProjectPath | None = None
    iterations: ProjectPath | None = None
    derivative: ProjectPath | None = None
    growth_rates: ProjectPath | None = None
