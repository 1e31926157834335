"""Experiments on systems of several states and inputs: references with a proof."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, PositiveInt, model_validator

from pipeline.experiments.fields import PriorFields
from pipeline.experiments.model import Experiment
from pipeline.experiments.plants import ModelField, SetField
from pipeline.experiments.sources import Drawn, Source, SourceField
from pipeline.published.ground_truth import GROUND_TRUTHS, GroundTruth
from pipeline.storage.yaml_file import Fields
from trackable.certificates.goal import Goal, for_all_times, on_window
from trackable.gp.joint import JointPrior
from trackable.gp.prior import NOISE, Prior
from trackable.gp.samples import Samples
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.sampling import stencils_by_name
from trackable.systems.sets.interval import Interval


class Looks(Fields):
    """Up to which step references are looked at, at `instants_per_step` times in each sampling interval."""

    last_step: PositiveInt
    instants_per_step: PositiveInt = 1


def _window(written: object) -> object:
    return tuple(map(float, written)) if isinstance(written, list) else written


def _names(written: object) -> object:
    return frozenset(written) if isinstance(written, list) else written


def _priors(written: object) -> object:
    if not isinstance(written, dict):
        raise ValueError("expected a mapping from what is sampled to its prior")
    return {name: PriorFields.model_validate(fields) for name, fields in written.items()}


def _sources(written: object) -> object:
    return written if isinstance(written, dict) and written else _refuse_sources()


def _refuse_sources() -> object:
    raise ValueError("expected a mapping from what is sampled to where samples come from")


class TrackingExperiment(Experiment):
    """References of a system with a proof for all times, or for a `window` [s]; `shared` names common hyperparameters.

    `samples` and `prior` are by the names of sampled states, one for each flat output.
    """

    kind: Literal["tracking"]
    samples: Annotated[dict[str, SourceField], BeforeValidator(_sources)]
    system: ModelField
    state_set: SetField
    input_set: SetField
    prior: Annotated[dict[str, PriorFields], BeforeValidator(_priors)]
    shared: Annotated[frozenset[str], BeforeValidator(_names)] = frozenset()

    window: Annotated[tuple[float, float] | None, BeforeValidator(_window)] = None
    verification: Looks

    @model_validator(mode="after")
    def _consistent(self) -> "TrackingExperiment":
        if self.samples.keys() != self.prior.keys():
            raise ValueError(
                f"samples and prior must have the same names, got {', '.join(self.samples)} and {', '.join(self.prior)}"
            )
        for name, source in self.samples.items():
            if isinstance(source, Drawn) and source.ground_truth not in GROUND_TRUTHS:
                raise ValueError(f"samples.{name}.ground_truth: expected one of {', '.join(GROUND_TRUTHS)}")
        _ = self.constrained_system, self.learned_prior  # raise what the mathematics would refuse
        return self

    @property
    def constrained_system(self) -> ConstrainedSystem:
        return ConstrainedSystem(self.system.discrete, self.state_set.polytope, self.input_set.polytope)

    @property
    def names(self) -> tuple[str, ...]:
        """What is sampled, in the order of the flat outputs."""
        return tuple(stencils_by_name(self.constrained_system, self.samples))

    @property
    def sources(self) -> dict[str, Source]:
        """Where samples come from, in the same order."""
        return {name: self.samples[name] for name in self.names}

    @property
    def learned_prior(self) -> JointPrior:
        parts = []
        for name, stencil in stencils_by_name(self.constrained_system, self.samples).items():
            fields = self.prior[name]
            fixed = fields.kernel.fixed | ({NOISE} if fields.noise_std.bounds is None else frozenset())
            level = (fields.mean - stencil.offset) / sum(stencil.weights)
            parts.append(Prior(fields.kernel.kernel, fields.noise_std.value, level, frozenset(fixed)))
        return JointPrior(tuple(parts), self.names, self.shared)

    @property
    def bounds(self) -> dict[str, Interval]:
        found: dict[str, Interval] = {}
        for name in self.names:
            noise = self.prior[name].noise_std.bounds
            own: dict[str, Any] = {**self.prior[name].kernel.bounds, **({NOISE: noise} if noise else {})}
            found |= {self.learned_prior.called(name, parameter): bounds for parameter, bounds in own.items()}
        return found

    @property
    def truths(self) -> Mapping[str, GroundTruth]:
        drawn = {name: source for name, source in self.sources.items() if isinstance(source, Drawn)}
        return {name: GROUND_TRUTHS[source.ground_truth] for name, source in drawn.items()}

    @property
    def last_step(self) -> int:
        return self.verification.last_step

    @property
    def instants_per_step(self) -> int:
        return self.verification.instants_per_step

    def goal(self, samples: tuple[Samples, ...]) -> Goal:
        if self.window:
            return on_window(*self.window)
        return for_all_times(samples, self.learned_prior, self.constrained_system)
