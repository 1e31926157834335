"""Experiments on scalar systems, one class for each kind of reference, and what their fields mean to mathematics."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, field_validator, model_validator

from pipeline.experiments.control import Control
from pipeline.experiments.fields import (
    Algorithm1,
    IntervalField,
    Periodic,
    PriorFields,
    ProjectPath,
    SampleDraw,
    SampleFile,
    Search,
    System,
    Verification,
    which_samples,
)
from pipeline.published.ground_truth import GROUND_TRUTHS, GroundTruth
from pipeline.storage.yaml_file import Fields
from trackable.certificates.goal import Goal, for_all_times
from trackable.gp.joint import JointPrior
from trackable.gp.prior import NOISE, Prior
from trackable.gp.samples import Samples
from trackable.learning.methods import period_of
from trackable.learning.published.scalar import scalar
from trackable.learning.space import SearchSpace
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.sets.interval import Interval

STATE = "state"
"""What is sampled of a scalar system."""


class Experiment(Fields):
    """What every entry of params.yaml has, validated, and what the stages ask of it."""

    kind: str
    name: str
    title: str
    search: Search
    control: Control = Control()

    @property
    @abstractmethod
    def constrained_system(self) -> ConstrainedSystem:
        """The system with its sets."""

    @property
    @abstractmethod
    def learned_prior(self) -> JointPrior:
        """The prior, with what is known of it fixed."""

    @property
    @abstractmethod
    def truths(self) -> Mapping[str, GroundTruth]:
        """The signals behind the samples, by what is sampled, where they are known."""

    @property
    @abstractmethod
    def bounds(self) -> dict[str, Interval]:
        """Where hyperparameters are sought, for those of which that is written."""

    @property
    @abstractmethod
    def last_step(self) -> int:
        """Up to which step references are looked at."""

    @property
    @abstractmethod
    def instants_per_step(self) -> int:
        """At how many times in each sampling interval."""

    def search_space(self, samples: tuple[Samples, ...]) -> SearchSpace:
        """Where the learned hyperparameters are looked for: as written, or from the scales of the samples."""
        return SearchSpace.around(samples, self.learned_prior, self.bounds, self.search.starts)

    def goal(self, samples: tuple[Samples, ...]) -> Goal:
        """What a certified reference has to be proved for."""
        return for_all_times(samples, self.learned_prior, self.constrained_system)

    def check(self, samples: tuple[Samples, ...]) -> None:
        """Raise ValueError where the samples leave something open that the parameters cannot know."""


class ScalarExperiment(Experiment):
    """One state, one input: what the paper's methods are for."""

    ground_truth: str | None = None
    samples: Annotated[SampleFile | SampleDraw, BeforeValidator(which_samples)]
    system: System
    state_set: IntervalField
    input_set: IntervalField
    prior: PriorFields
    verification: Verification

    @field_validator("ground_truth")
    @classmethod
    def _known(cls, value: str | None) -> str | None:
        if value is not None and value not in GROUND_TRUTHS:
            raise ValueError(f"expected one of {', '.join(GROUND_TRUTHS)}")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> "ScalarExperiment":
        _ = self.constrained_system, self.learned_prior  # raise what the mathematics would refuse
        if isinstance(self.samples, SampleDraw) and self.ground_truth is None:
            raise ValueError("samples are drawn from the ground truth, but ground_truth is not given")
        return self

    @property
    def constrained_system(self) -> ConstrainedSystem:
        s = self.system
        return scalar(s.a, s.b, s.c, state_set=self.state_set, input_set=self.input_set, sampling_time=s.sampling_time)

    @property
    def truths(self) -> Mapping[str, GroundTruth]:
        return {STATE: GROUND_TRUTHS[self.ground_truth]} if self.ground_truth else {}

    @property
    def last_step(self) -> int:
        return self.verification.last_step

    @property
    def instants_per_step(self) -> int:
        return self.verification.instants_per_step

    @property
    def learned_prior(self) -> JointPrior:
        noise, choice = self.prior.noise_std, self.prior.kernel
        fixed = choice.fixed | ({NOISE} if noise.bounds is None else set())
        return JointPrior((Prior(choice.kernel, noise.value, self.prior.mean, frozenset(fixed)),))

    @property
    def bounds(self) -> dict[str, Interval]:
        noise = self.prior.noise_std.bounds
        return {**self.prior.kernel.bounds, **({NOISE: noise} if noise else {})}

    def drawn(self, draw: SampleDraw, seed: int) -> Samples:
        """The samples that a seed gives."""
        steps = np.arange(draw.steps.first, draw.steps.last + 1, draw.steps.every, dtype=float)
        times = steps * self.system.sampling_time
        noise = draw.noise_std * np.random.default_rng(seed).standard_normal(times.size)
        return Samples(times, GROUND_TRUTHS[self.ground_truth or ""](times) + noise)


class AsymptoticExperiment(ScalarExperiment):
    """A reference that becomes constant: Algorithm 1."""

    kind: Literal["asymptotic"]
    algorithm1: Algorithm1
    published_prediction: ProjectPath | None = None

    @model_validator(mode="after")
    def _verified_to_the_end(self) -> "AsymptoticExperiment":
        if self.verification.last_step < self.algorithm1.last_step:
            raise ValueError(
                f"verification.last_step must not lie before algorithm1.last_step = {self.algorithm1.last_step}, "
                f"got {self.verification.last_step}"
            )
        return self


class PeriodicExperiment(ScalarExperiment):
    """A periodic reference: the paper's (6) and (9), and the exact form."""

    kind: Literal["periodic"]
    periodic: Periodic
    published_derivative: ProjectPath | None = None
    published_growth_rates: ProjectPath | None = None

    @model_validator(mode="after")
    def _has_a_period(self) -> "PeriodicExperiment":
        try:
            period_of([self.prior.kernel.kernel])
        except TypeError as error:
            raise ValueError(f"prior.kernel: {error}") from None
        if self.periodic.draws and not isinstance(self.samples, SampleDraw):
            raise ValueError("periodic.draws compares seeds, but the samples are not drawn")
        return self

    def check(self, samples: tuple[Samples, ...]) -> None:
        space, prior = self.search_space(samples), self.learned_prior
        longest = (
            space.bounds["period"].upper
            if "period" in space.bounds
            else period_of([part.kernel for part in prior.parts])
        )
        for name, last_step in (("periodic", self.periodic.last_step), ("verification", self.verification.last_step)):
            if last_step * self.system.sampling_time < longest * (1 - 1e-12):
                raise ValueError(
                    f"{name}.last_step = {last_step} steps last {last_step * self.system.sampling_time:g} s, and have "
                    f"to last at least one period, which may be as long as {longest:g} s"
                )
