"""The parts of an experiment as written in params.yaml, except its system and its samples."""

import dataclasses
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    NonNegativeInt,
    PlainValidator,
    PositiveFloat,
    PositiveInt,
    Strict,
    model_validator,
)

from pipeline.published.ground_truth import GROUND_TRUTHS, GroundTruth, draw
from pipeline.yaml_file import Fields
from trackably.arguments import is_number
from trackably.arrays import Array
from trackably.certificates.claim import as_claim
from trackably.checker.certificate import Claim
from trackably.gp.hyperparameter import hyperparameter
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.elementary import Elementary
from trackably.gp.kernels.registry import KERNELS
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.space import MOST_STARTS
from trackably.reference.condensed import Centres, checked_centres
from trackably.systems.written import fields_of, read_part

T = TypeVar("T")


def parse_kernel(written: object) -> Kernel:
    """Return the kernel of a mapping with a `type` and hyperparameters, which are known, learned, or left out.

    Raises ValueError, naming the field, for an unknown type, field or value.
    """
    if not isinstance(written, dict) or "type" not in written:
        raise ValueError(f"expected a mapping with a `type`, got {written!r}")
    if (kernel := KERNELS.get(str(written["type"]))) is None:
        raise ValueError(f"type: expected one of {', '.join(KERNELS)}, got {written['type']!r}")
    names, elementary = [field.name for field in dataclasses.fields(kernel)], issubclass(kernel, Elementary)
    given = fields_of(written, ["type", *names], [] if elementary else names)
    parse = parse_hyperparameter if elementary else parse_kernel
    return kernel(**{name: read_part(given, name, parse) for name in names if name in given})


def parse_hyperparameter(written: object) -> float:
    """Return a positive number (known), or a hyperparameter to learn in [lower, upper]. ValueError otherwise."""
    try:
        return hyperparameter("nothing" if written is None else written)
    except ValueError as error:
        raise ValueError(f"expected {error}, got {written!r}") from None


def read_by(read: Callable[[Any], T]) -> Callable[[Any], T]:
    """Return a validator that reads a field by `read`; its errors do not name the field, as the caller names it."""

    def validated(written: Any) -> T:
        try:
            return read(written)
        except (TypeError, ValueError) as error:
            raise ValueError(re.sub(r"^(system|set|disturbance|truth|claim): ", "", str(error))) from error

    return validated


def parse_claim(written: object) -> Claim:
    """Return the claim of `all_times`, `all_phases` or `{window: [start, end]}` [s]. ValueError for anything else."""
    match written:
        case "all_times" | "all_phases":
            return as_claim(written)
        case {"window": [start, end], **rest} if not rest:
            return as_claim((start, end))
    raise ValueError("expected all_times, all_phases or {window: [start, end]}")


ClaimField = Annotated[Claim, BeforeValidator(read_by(parse_claim))]


def by_name(written: object) -> object:
    """Return `written` if it is a mapping with entries. ValueError otherwise."""
    if not isinstance(written, dict) or not written:
        raise ValueError("expected a mapping from the names of sampled states, as {position: …}")
    return written


def _known_truth(name: str) -> str:
    if name not in GROUND_TRUTHS:
        raise ValueError(f"expected one of {', '.join(GROUND_TRUTHS)}, got {name!r}")
    return name


def _plain_unit(unit: str) -> str:
    if not re.fullmatch(r"(?:[^\W_]|[°%])[\w·/*^°%²³⁻¹–-]{0,19}|–", unit):
        raise ValueError(f"expected a unit such as mm, m/s² or –, got {unit!r:.60}")
    return unit


LISTED = Strict(False)
"""Lets a field with a tuple or a set accept the lists of YAML."""
ProjectPath = Annotated[Path, BeforeValidator(lambda written: Path(written) if isinstance(written, str) else written)]
CentresField = Annotated[Centres, PlainValidator(read_by(checked_centres))]
GroundTruthName = Annotated[str, AfterValidator(_known_truth)]
UnitField = Annotated[str, AfterValidator(_plain_unit)]
MOST_STEPS = 1_000_000
StepCount = Annotated[PositiveInt, Field(le=MOST_STEPS)]
"""A number of sampling steps; a larger one would take days of computation, and logs that fill the disk."""


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
    raise ValueError("expected a number (known) or [lower, upper] with lower < upper (learned); or leave it out")


class PriorFields(Fields):
    """The prior mean, the kernel, and the noise; hyperparameters and the mean are known or learned in an interval.

    Hyperparameters that are left out, noise_std among them, are learned in an interval chosen from the samples. A mean
    that is left out is learned without an interval. Samples of a second state that shows the same flat output as
    another one have no kernel and no mean of their own, and known noise.
    """

    mean: Annotated[float | tuple[float, float] | None, BeforeValidator(_mean)] = None
    kernel: Annotated[Kernel | None, PlainValidator(parse_kernel)] = None
    noise_std: Annotated[float, PlainValidator(parse_hyperparameter)] = hyperparameter(None)

    @property
    def prior(self) -> Prior:
        """The prior of the sampled state; a mean to be learned starts in the middle of its interval, or at zero."""
        assert self.kernel, "asked for where there is one"
        mean = sum(self.mean) / 2 if isinstance(self.mean, tuple) else self.mean
        return Prior(self.kernel, self.noise_std, mean or 0.0)


class Search(Fields):
    """The search for hyperparameters: the number of points from which it `starts`."""

    starts: Annotated[PositiveInt, Field(le=MOST_STARTS)] = 8


class Verification(Fields):
    """Margins are computed up to step `last_step`, at `instants_per_step` times in each sampling interval."""

    last_step: StepCount
    instants_per_step: PositiveInt = 1


class Published(Fields):
    """Files with curves that the paper prints, for figures that show these curves beside ours."""

    prediction: ProjectPath | None = None
    iterations: ProjectPath | None = None
    derivative: ProjectPath | None = None
    growth_rates: ProjectPath | None = None


class NoisySteps(Fields):
    """Samples of a ground truth at `steps`, with independent normal noise from NumPy's default generator."""

    steps: Steps
    noise_std: PositiveFloat
    seed: NonNegativeInt

    def samples(self, truth: GroundTruth, sampling_time: float) -> Samples:
        """Return the samples of a ground truth."""
        return draw(truth, self.steps.times(sampling_time), self.noise_std, self.seed)


class Relearning(Fields):
    """Samples arrive while the loop runs, and the reference is learned again from the last `window` samples.

    `window` is a number of samples of each signal. The first reference is learned from the samples up to step `first`,
    or from all samples without `first`. Later references are learned after each `every` steps while samples arrive.
    Samples that arrive are those of `stream`, or without `stream` the held-out samples.
    """

    first: PositiveInt | None = None
    window: PositiveInt
    every: PositiveInt
    stream: NoisySteps | None = None


class Control(Fields):
    """Tracking MPC over `horizon` steps, for `steps` steps from each initial state.

    The cost is the squared error relative to the widths of the sets. A loop ends after more than `patience` infeasible
    steps. Figures show the first `shown` steps of a loop.
    """

    horizon: PositiveInt = 20
    steps: StepCount = 600
    patience: NonNegativeInt = 100
    shown: PositiveInt = 150
    online: Relearning | None = None
