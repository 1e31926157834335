"""The parts of an experiment as written in params.yaml."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import (
    BeforeValidator,
    Field,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    model_validator,
)

from pipeline.experiments.kernel_choice import Hyperparameter, KernelChoice
from pipeline.storage.yaml_file import Fields
from trackable.systems.sets.interval import Interval


def _interval(written: object) -> Interval:
    match written:
        case [int() | float() as lower, int() | float() as upper] if not isinstance(lower, bool | None):
            if not lower < upper:
                raise ValueError("expected lower < upper")
            return Interval(float(lower), float(upper))
    raise ValueError("expected [lower, upper], two numbers")


IntervalField = Annotated[Interval, BeforeValidator(_interval)]


ProjectPath = Annotated[Path, BeforeValidator(lambda written: Path(written) if isinstance(written, str) else written)]


class SampleFile(Fields):
    """Samples from a CSV file with a header: a time column, in seconds or sampling steps, and a value column."""

    file: ProjectPath
    time_column: str
    time_unit: Literal["seconds", "steps"]
    value_column: str


class Steps(Fields):
    """The sampling steps first, first + every, … up to last."""

    first: NonNegativeInt
    last: PositiveInt
    every: PositiveInt

    @model_validator(mode="after")
    def _ordered(self) -> "Steps":
        if self.last < self.first:
            raise ValueError(f"expected first ≤ last, got first = {self.first}, last = {self.last}")
        return self


class SampleDraw(Fields):
    """Samples drawn from the ground truth at `steps`, with independent normal noise from NumPy's default generator."""

    steps: Steps
    noise_std: PositiveFloat
    seed: NonNegativeInt


def which_samples(written: object) -> object:
    """A file of samples or a draw, by what is written. ValueError for neither."""
    if not isinstance(written, dict):
        raise ValueError("expected a mapping with either `file` or `seed`")
    return (SampleFile if "file" in written else SampleDraw).model_validate(written)


class System(Fields):
    """x(k+1) = a x(k) + b u(k) + c, sampled every `sampling_time` [s]."""

    a: float
    b: float
    c: float = 0.0
    sampling_time: PositiveFloat


class PriorFields(Fields):
    """The prior mean, the kernel, and the noise: hyperparameters known or learned."""

    mean: float
    kernel: Annotated[KernelChoice, BeforeValidator(KernelChoice.parse)]
    noise_std: Annotated[Hyperparameter, BeforeValidator(Hyperparameter.parse)]


class Search(Fields):
    """How many points the search starts from."""

    starts: PositiveInt


class Algorithm1(Fields):
    """k̄ of the first iteration, and the k̄ after which to give up."""

    first_step: PositiveInt
    last_step: PositiveInt

    @model_validator(mode="after")
    def _ordered(self) -> "Algorithm1":
        if self.last_step < self.first_step:
            raise ValueError(f"expected first_step ≤ last_step, got {self.first_step} and {self.last_step}")
        return self


class Verification(Fields):
    """Up to which step references are checked at `instants_per_step` times in each sampling interval."""

    last_step: PositiveInt
    instants_per_step: Annotated[int, Field(ge=100)]


def as_tuple(written: object) -> object:
    """A list as the tuple that a frozen field holds; anything else as it is."""
    return tuple(written) if isinstance(written, list) else written


class Periodic(Fields):
    """k̄ of the grid and of the intervals, their number η, and the part of each bound's width that is kept as room.

    `conservatism` names other η to compare with; `draws` is how many seeds to compare (samples have to be drawn then).
    """

    last_step: PositiveInt
    intervals: PositiveInt
    backoff: Annotated[float, Field(gt=0, le=0.01)]
    conservatism: Annotated[tuple[PositiveInt, ...], BeforeValidator(as_tuple)] = ()
    draws: NonNegativeInt = 0
