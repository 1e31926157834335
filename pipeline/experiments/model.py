"""The fields of an experiment, and what they mean to the mathematics."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    field_validator,
    model_validator,
)

from pipeline.experiments.kernel_choice import Hyperparameter, KernelChoice
from pipeline.gp.prior import NOISE, Prior
from pipeline.gp.samples import Samples
from pipeline.ground_truth import GROUND_TRUTHS
from pipeline.learning.space import SearchSpace
from pipeline.systems.interval import Interval
from pipeline.systems.scalar import ConstrainedSystem, ScalarLinear


class _Fields(BaseModel):
    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, arbitrary_types_allowed=True
    )


def _interval(written: object) -> Interval:
    match written:
        case [int() | float() as lower, int() | float() as upper] if not isinstance(lower, bool | None):
            if not lower < upper:
                raise ValueError("expected lower < upper")
            return Interval(float(lower), float(upper))
    raise ValueError("expected [lower, upper], two numbers")


Set = Annotated[Interval, BeforeValidator(_interval)]


ProjectPath = Annotated[Path, BeforeValidator(lambda written: Path(written) if isinstance(written, str) else written)]


class SampleFile(_Fields):
    """Samples from a CSV file with a header: a time column, in seconds or sampling steps, and a value column."""

    file: ProjectPath
    time_column: str
    time_unit: Literal["seconds", "steps"]
    value_column: str


class Steps(_Fields):
    """The sampling steps first, first + every, … up to last."""

    first: NonNegativeInt
    last: PositiveInt
    every: PositiveInt

    @model_validator(mode="after")
    def _ordered(self) -> "Steps":
        if self.last < self.first:
            raise ValueError(f"expected first ≤ last, got first = {self.first}, last = {self.last}")
        return self


class SampleDraw(_Fields):
    """Samples drawn from the ground truth at `steps`, with independent normal noise from NumPy's default generator."""

    steps: Steps
    noise_std: PositiveFloat
    seed: NonNegativeInt


def _which_samples(written: object) -> object:
    if not isinstance(written, dict):
        raise ValueError("expected a mapping with either `file` or `seed`")
    return (SampleFile if "file" in written else SampleDraw).model_validate(written)


class System(_Fields):
    """x(k+1) = a x(k) + b u(k) + c, sampled every `sampling_time` [s]."""

    a: float
    b: float
    c: float = 0.0
    sampling_time: PositiveFloat


class PriorFields(_Fields):
    """The prior mean, the kernel, and the noise: hyperparameters known or learned."""

    mean: float
    kernel: Annotated[KernelChoice, BeforeValidator(KernelChoice.parse)]
    noise_std: Annotated[Hyperparameter, BeforeValidator(Hyperparameter.parse)]


class Search(_Fields):
    """How many points the search starts from."""

    starts: PositiveInt


class Algorithm1(_Fields):
    """k̄ of the first iteration, and the k̄ after which to give up."""

    first_step: PositiveInt
    last_step: PositiveInt

    @model_validator(mode="after")
    def _ordered(self) -> "Algorithm1":
        if self.last_step < self.first_step:
            raise ValueError(f"expected first_step ≤ last_step, got {self.first_step} and {self.last_step}")
        return self


class Verification(_Fields):
    """Up to which step references are checked at `instants_per_step` times in each sampling interval."""

    last_step: PositiveInt
    instants_per_step: Annotated[int, Field(ge=100)]


class Experiment(_Fields):
    """One entry of params.yaml, validated."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")]
    title: str
    ground_truth: str | None = None
    samples: Annotated[SampleFile | SampleDraw, BeforeValidator(_which_samples)]
    system: System
    state_set: Set
    input_set: Set
    prior: PriorFields
    search: Search
    algorithm1: Algorithm1
    verification: Verification
    published_prediction: ProjectPath | None = None

    @field_validator("ground_truth")
    @classmethod
    def _known(cls, value: str | None) -> str | None:
        if value is not None and value not in GROUND_TRUTHS:
            raise ValueError(f"expected one of {', '.join(GROUND_TRUTHS)}")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> "Experiment":
        _ = self.constrained_system, self.learned_prior  # raise what the mathematics would refuse
        if isinstance(self.samples, SampleDraw) and self.ground_truth is None:
            raise ValueError("samples are drawn from the ground truth, but ground_truth is not given")
        if self.verification.last_step < self.algorithm1.last_step:
            raise ValueError(
                f"verification.last_step must not lie before algorithm1.last_step = {self.algorithm1.last_step}, "
                f"got {self.verification.last_step}"
            )
        return self

    @property
    def constrained_system(self) -> ConstrainedSystem:
        """The system with its sets."""
        s = self.system
        return ConstrainedSystem(ScalarLinear(s.a, s.b, s.c), self.state_set, self.input_set, s.sampling_time)

    @property
    def learned_prior(self) -> Prior:
        """The prior, with what is known of it fixed."""
        noise, choice = self.prior.noise_std, self.prior.kernel
        fixed = choice.fixed | ({NOISE} if noise.bounds is None else set())
        return Prior(choice.kernel, noise.value, self.prior.mean, frozenset(fixed))

    def search_space(self, samples: Samples) -> SearchSpace:
        """Where the learned hyperparameters are looked for: as written, or from the scales of the samples."""
        noise = self.prior.noise_std.bounds
        bounds: dict[str, Any] = {**self.prior.kernel.bounds, **({NOISE: noise} if noise else {})}
        return SearchSpace.around(samples, self.learned_prior, bounds, self.search.starts)
