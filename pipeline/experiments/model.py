"""The form of an experiment in params.yaml, and the objects of the library that its fields describe."""

import math
import re
import warnings
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from pipeline.experiments.fields import (
    LISTED,
    MOST_STEPS,
    CentresField,
    ClaimField,
    Control,
    PriorFields,
    ProjectPath,
    Published,
    Search,
    UnitField,
    Verification,
    by_name,
)
from pipeline.experiments.plants import Disturbance, ModelField, SetField, TruthField, tightened
from pipeline.experiments.sources import GROUND_TRUTHS_FILE, Source, SourceField
from pipeline.methods import METHODS, REQUIRED, ROBUST, Algorithm1, Method, Periodic, Task
from pipeline.published.ground_truth import GROUND_TRUTHS, GroundTruth
from pipeline.yaml_file import Fields
from trackably.arrays import Array
from trackably.certificates.claim import refusal
from trackably.certificates.goal import Goal, goal_for
from trackably.checker.certificate import AllPhases, TrueSignal, Window
from trackably.errors import DoubtfulInputWarning, InputError, NoReferenceError
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.learning.space import SearchSpace
from trackably.reference.empirical_bayes import empirical_prior, levels, split_means
from trackably.reference.request import Measurements, quantities_at_rest
from trackably.reference.truth import true_signals
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.sampling import kinds_by_name, prior_for
from trackably.systems.tightening import Tightening

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")
_RESERVED = {"guide", "recordings", "trajectories", "template"}


def refused_names(names: Iterable[object]) -> list[str]:
    """Return one sentence for each name that an experiment cannot have; an empty list if there is none."""
    first: dict[str, str] = {}
    found = []
    for name in names:
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            found.append(
                f"the name {name!r} is not allowed: a name consists of letters from a to z, digits, hyphens and "
                "underscores, and begins with a letter or a digit (quote a name that is a number)"
            )
        elif name.lower() in _RESERVED:
            found.append(f"the name {name!r} is reserved, as a notebook or a folder of the project has it")
        elif (other := first.setdefault(name.lower(), name)) != name:  # some file systems cannot hold both
            found.append(f"the names {other!r} and {name!r} differ only by case: choose names that differ otherwise")
    return found


def mistakes_of_priors(plant: ConstrainedSystem, prior: Mapping[str, PriorFields]) -> Iterator[str]:
    """Yield one sentence for each prior that does not fit the state of its name. ValueError: a name is unknown."""
    for first, *others in kinds_by_name(plant, prior):
        if prior[first].kernel is None:
            yield f"prior.{first}.kernel: is missing"
        for name in others:
            if prior[name].model_fields_set - {"noise_std"}:
                yield f"prior.{name}: expected noise_std alone, as {first} shows the same flat output"
        for name in (first, *others) if others else ():
            if isinstance(prior[name].noise_std, Learned):
                yield f"prior.{name}.noise_std: must be a number, as {' and '.join(others)} show the same flat output"


_ROUNDING = 1e-9  # in steps: an end of a window this near to a step counts as at the step


def _methods(written: object) -> object:
    if not isinstance(written, list) or not written:
        raise ValueError("expected a list of methods")
    if unknown := [name for name in written if not isinstance(name, str) or name not in METHODS]:
        raise ValueError(f"there is no method {unknown[0]!r}; there are {', '.join(METHODS)}")
    if len(set(written)) < len(written):
        raise ValueError(f"expected each method once, got {', '.join(written)}")
    if missing := [method.name for method in REQUIRED if method.name not in written]:
        raise ValueError(f"expected {' and '.join(missing)} among them, got {', '.join(written)}")
    return tuple(written)


class Experiment(Fields):
    """A system, its sets, samples, a prior, a claim, and the methods by which references are learned.

    `samples_from` is the file that the samples come from, or a folder above all their files: when it changes, DVC runs
    the stages again. `samples` and `prior` are by name: the name of a state, or "rate of x" for a state x, at least one
    for each flat output. If several names show one flat output, the first has the prior, and the others only their
    noise. If a name has more than 500 samples, references are learned from fewer `centres`, as many as the samples
    need for any kernel; a number is the largest number of centres, and None makes each sample a centre. Hyperparameters
    that `shared` names are the same for all flat outputs. Figures name the `units` of states and inputs, and draw paths
    in the plane of the two states `plane`, if given. All references keep the part `margin` of each width free at either
    bound. Robust methods also leave room for every error that a `disturbance` may cause; the other methods ignore it.
    Certificates bound the distance from every true signal that fits `truth`, by the name of its samples. `algorithm1`
    and `periodic` are read by the methods that need them. References are also learned for each upper bound of the only
    state in `tightness`. Without `verification`, it is chosen as `verified` says.
    """

    name: str
    title: str
    samples_from: ProjectPath
    system: ModelField
    state_set: SetField
    input_set: SetField
    units: dict[str, UnitField] = Field(default_factory=dict)
    disturbance: Disturbance | None = None
    truth: dict[str, TruthField] = Field(default_factory=dict)
    margin: Annotated[float, Field(ge=0, lt=0.5)] = 0.0
    samples: Annotated[dict[str, SourceField], BeforeValidator(by_name)]
    centres: CentresField = "auto"
    prior: Annotated[dict[str, PriorFields], BeforeValidator(by_name)]
    shared: Annotated[frozenset[str], LISTED] = frozenset()
    plane: Annotated[tuple[str, str] | None, LISTED] = None
    claim: ClaimField
    methods: Annotated[tuple[str, ...], BeforeValidator(_methods)]
    search: Search = Search()
    verification: Verification | None = None
    control: Control = Control()
    algorithm1: Algorithm1 | None = None
    periodic: Periodic | None = None
    tightness: Annotated[tuple[float, ...], LISTED] = ()
    published: Published = Published()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        """Raise ValueError if fields do not fit each other, with the sentences of all checks, each once."""
        said: dict[str, None] = {}
        for check in _CHECKS:
            try:
                said |= dict.fromkeys(check(self))
            except (TypeError, ValueError) as error:
                said[str(error)] = None
            except OverflowError as error:
                said[f"a number is too large to compute with: {error}"] = None
        if said:
            raise ValueError("; ".join(said))
        return self

    def _mistakes_of_names(self) -> Iterator[str]:
        if self.samples.keys() != self.prior.keys():
            names = f"{', '.join(self.samples)} and {', '.join(self.prior)}"
            yield f"samples and prior must have the same names, got {names}"

    def _mistakes_of_mathematics(self) -> Iterator[str]:
        """Yield mistakes of the priors; without any, claims and methods that do not suit the system and the priors."""
        if mistakes := list(mistakes_of_priors(self.plant, self.prior)):
            yield from mistakes
            return
        plant, prior = self.plant, self.learned_prior
        if reason := refusal(self.claim, prior):
            yield f"claim: {reason}"
        for method in self.learned_by:
            try:
                method.check(plant, prior)
            except (TypeError, ValueError) as error:
                yield f"methods: {method.name}: {error}"

    def _mistakes_of_the_disturbance(self) -> Iterator[str]:
        """Raise ValueError if the disturbance does not fit the system, or leaves nothing of the bounds."""
        _ = self.tightening
        yield from ()

    def _mistakes_of_truth(self) -> Iterator[str]:
        known = [name for name in self.samples if name in self.plant.system.states]
        for name, fields in self.truth.items():
            if not isinstance(self.plant.system, LinearSystem) or name not in known:
                yield f"truth: expected sampled states of a linear system, got {name}"
            elif fields.rate is not None and fields.rate not in self.samples:
                yield f"truth.{name}.rate: expected the name of samples, got {fields.rate}"

    def _mistakes_of_figures(self) -> Iterator[str]:
        system = self.system.discrete
        if unknown := {*(self.plane or ())} - {*system.states}:
            yield f"plane: expected two of the states {', '.join(system.states)}, got {min(unknown)}"
        if misnamed := self.units.keys() - {*system.states, *system.inputs}:
            known = ", ".join((*system.states, *system.inputs))
            yield f"units: expected states and inputs among {known}, got {min(misnamed)}"

    def _mistakes_of_origin(self) -> Iterator[str]:
        """Yield one sentence for each source of samples that is not below `samples_from`, the path that DVC watches."""
        files = {name: file for name, source in self.samples.items() if (file := source.file) is not None}
        for name, file in files.items():
            if not file.is_relative_to(self.samples_from):
                yield f"samples_from: expected {file}, as for {name}, or a folder above it, got {self.samples_from}"
        if not files and self.samples_from != GROUND_TRUTHS_FILE:
            yield f"samples_from: all samples are drawn; expected {GROUND_TRUTHS_FILE}, got {self.samples_from}"

    def _mistakes_of_methods(self) -> Iterator[str]:
        for method in self.learned_by:
            if missing := [block for block in method.needs if getattr(self, block) is None]:
                yield f"{' and '.join(missing)}: is missing, but the method {method.name} needs it"
        if self.disturbance and ROBUST.name not in self.methods:
            given = ", ".join(self.methods)
            yield f"methods: expected {ROBUST.name} among them, because there is a disturbance, got {given}"
        if self.algorithm1 and self.verification and self.verification.last_step < self.algorithm1.last_step:
            yield (
                f"verification.last_step must not lie before algorithm1.last_step = {self.algorithm1.last_step}, "
                f"got {self.verification.last_step}"
            )

    def _mistakes_of_tightness(self) -> Iterator[str]:
        if self.tightness and not (self.truths and self.state_set.rows.tolist() == [[1.0]] and len(self.samples) == 1):
            yield "tightness: expected samples of one state in a box, and its ground truth, as the bound is moved"
        for upper in self.tightness:
            try:
                _ = self.with_upper_bound(upper).plant
            except ValueError as error:
                yield f"tightness: {upper:g}: {error}"

    @property
    def plant(self) -> ConstrainedSystem:
        """The system with its sets, whose bounds are tightened by the `margin`."""
        return tightened(self.system, self.state_set, self.input_set, None, self.margin).plant

    @property
    def tightening(self) -> Tightening | None:
        """The tightening of the bounds for the disturbance and by the margin; None without a disturbance."""
        if self.disturbance is None:
            return None
        return tightened(self.system, self.state_set, self.input_set, self.disturbance, self.margin)

    def plant_of(self, method: str) -> ConstrainedSystem:
        """Return the system with the sets within which a method learns."""
        tightening = self.tightening
        return tightening.plant if tightening and METHODS[method].is_robust else self.plant

    def with_upper_bound(self, upper: float) -> "Experiment":
        """Return the experiment with another upper bound of its only state."""
        return self.model_copy(update={"state_set": Polytope.box(self.state_set.lower, [upper])})

    @property
    def sources(self) -> dict[str, Source]:
        """Where samples come from, in the order of the flat outputs."""
        return {name: self.samples[name] for kinds in kinds_by_name(self.plant, self.samples) for name in kinds}

    def measured(self, samples: Mapping[str, Samples]) -> Measurements:
        """Return samples by name with their noise; fewer `centres` stand for them, as the experiment says."""
        noise = {name: fields.noise_std for name, fields in self.prior.items()}
        return Measurements.of(samples, self.plant, noise, self.centres)

    @property
    def learned_prior(self) -> JointPrior:
        """The prior of the flat outputs."""
        believed = {name: fields.prior for name, fields in self.prior.items() if fields.kernel}
        return prior_for(self.plant, believed, self.shared)

    @property
    def truths(self) -> Mapping[str, GroundTruth]:
        """The true signals of samples by their names, if they are known."""
        known = {name: source.ground_truth for name, source in self.sources.items()}
        return {name: GROUND_TRUTHS[truth] for name, truth in known.items() if truth is not None}

    def signals(self, samples: Mapping[str, Samples]) -> tuple[TrueSignal, ...]:
        """Return what is to be proved about the true signals that `truth` and the samples allow.

        Raises NotTrackableError if no signal explains the samples, and InputError if centres stand for the samples.
        """
        if fewer := [name for name in self.truth if samples[name].scatters]:
            raise InputError(
                f"experiment {self.name}: truth: centres stand for samples of {fewer[0]}; set centres: null to use all"
            )
        return true_signals(self.truth, None, samples, self.plant, self.claim)[1]

    @property
    def learned_by(self) -> tuple[Method, ...]:
        """The methods, in the order in which the experiment names them."""
        return tuple(METHODS[name] for name in self.methods)

    def search_space(self, samples: tuple[Samples, ...]) -> SearchSpace:
        """Return the intervals in which hyperparameters are learned, as given or chosen from the samples."""
        return SearchSpace.around(samples, self.learned_prior, self.search.starts)

    def goal(self, samples: tuple[Samples, ...]) -> Goal:
        """Return what a certified reference has to be proved for."""
        return goal_for(self.claim, samples, self.learned_prior, self.plant)

    def task(self, samples: tuple[Samples, ...]) -> Task:
        """Return the argument of methods: samples, prior, plant, search space and goal."""
        of = samples, self.learned_prior, self.plant, self.search_space(samples), self.goal(samples)
        return Task(*of, self.algorithm1, self.periodic, self.tightening)

    @property
    def loop_steps(self) -> range:
        """The steps of closed loops: from 0 on, or for a claimed window the steps whose horizon ends in the window."""
        if not isinstance(self.claim, Window):
            return range(self.control.steps)
        first, last = (t / self.plant.sampling_time for t in self.claim.span)
        start = max(math.ceil(first - _ROUNDING), 0)
        return range(start, min(start + self.control.steps, math.floor(last + _ROUNDING) - self.control.horizon))

    def verified(self, samples: tuple[Samples, ...]) -> Verification:
        """Return up to which step margins are computed: as `verification` says, or by default the latest of several.

        These are twice the time of the samples, the end of a claimed window, two periods if all phases are claimed, and
        the last step of each method.
        """
        if self.verification:
            return self.verification
        t_s = self.plant.sampling_time
        ends = [2 * float(max(of.times[-1] for of in samples))]
        ends += [self.claim.end] if isinstance(self.claim, Window) else []
        ends += [2 * self._longest_period(samples)] if isinstance(self.claim, AllPhases) else []
        ends += [block.last_step * t_s for block in (self.algorithm1, self.periodic) if block]
        return Verification(last_step=min(max(math.ceil(max(ends) / t_s), 1), MOST_STEPS))

    def verified_times(self, samples: tuple[Samples, ...]) -> Array:
        """Return the times [s] of the verified steps."""
        return np.arange(self.verified(samples).last_step + 1, dtype=float) * self.plant.sampling_time

    def _longest_period(self, samples: tuple[Samples, ...]) -> float:
        """Return the longest period [s] that may be learned from these samples."""
        space, known = self.search_space(samples), self.learned_prior.parts[0].kernel.period
        return space.bounds["period"].upper if "period" in space.bounds else known or 0.0

    def check(self, samples: tuple[Samples, ...]) -> None:
        """Raise ValueError if steps do not last the longest period that may be learned from these samples."""
        if not isinstance(self.claim, AllPhases):
            return
        t_s, longest = self.plant.sampling_time, self._longest_period(samples)
        blocks = {"periodic": self.periodic, "verification": self.verification}
        for name, last_step in ((name, block.last_step) for name, block in blocks.items() if block):
            if last_step * t_s < longest * (1 - 1e-12):
                raise ValueError(
                    f"{name}.last_step = {last_step} steps last {last_step * t_s:g} s, and have to last at least one "
                    f"period, which may be as long as {longest:g} s"
                )


_CHECKS = (
    Experiment._mistakes_of_names,
    Experiment._mistakes_of_mathematics,
    Experiment._mistakes_of_the_disturbance,
    Experiment._mistakes_of_truth,
    Experiment._mistakes_of_figures,
    Experiment._mistakes_of_origin,
    Experiment._mistakes_of_methods,
    Experiment._mistakes_of_tightness,
)
"""Checks of an experiment: each yields one sentence for each field that does not fit, or raises ValueError."""


def with_learned_means(experiment: Experiment, samples: tuple[Samples, ...]) -> Experiment:
    """Return the experiment with known prior means: means that are not given as numbers are learned from the samples.

    Raises NoReferenceError if the likelihood of the samples cannot be evaluated.
    """
    given = {name: of.mean for name, of in experiment.prior.items() if of.kernel}
    names = experiment.learned_prior.names
    of_level = {name: of.of_level for name, of in zip(names, samples, strict=True)}
    begun, between = split_means(given, names, of_level)
    if not between:
        return experiment
    prior, ends = _with_means(experiment, begun).learned_prior, levels(between, names, samples)
    at_rest = quantities_at_rest(experiment.claim, experiment.plant)
    try:
        found = empirical_prior(samples, prior, ends, experiment.search.starts, keep=False, at_rest=at_rest)
    except NoReferenceError as error:
        raise NoReferenceError(f"experiment {experiment.name}: prior.mean: {error}") from None
    for question in found.questions:
        warnings.warn(f"experiment {experiment.name}: {question}", DoubtfulInputWarning, stacklevel=2)
    named = zip(prior.names, found.prior.parts, samples, strict=True)
    learned = {name: float(of.of_level.stencil.at_rest(part.mean)) for name, part, of in named if name in between}
    return _with_means(experiment, learned)


def _with_means(experiment: Experiment, means: Mapping[str, float]) -> Experiment:
    known = {name: experiment.prior[name].model_copy(update={"mean": mean}) for name, mean in means.items()}
    return experiment.model_copy(update={"prior": {**experiment.prior, **known}})
