"""The samples to learn from: by name, with their relative noise, and fewer of them where there are many."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Self, TypeVar

import numpy as np

from trackable.arguments import is_number
from trackable.condensed.asked import MANY, Centres, checked_centres, condensed_by_name, cost_of
from trackable.condensed.cost import Condensation
from trackable.gp.hyperparameter import Learned
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.base import Kernel
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples
from trackable.request.prior import Noise, priors_by_name, value_of
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.frames import Column, Frame, is_column, is_frame, samples_of_column, samples_of_frame
from trackable.systems.sampling import default_sample, kinds_by_name, relative_to_first, sampled_signals

T = TypeVar("T")

SamplesLike = Samples | Column | Frame | Mapping[str, Samples | Column]
"""Samples as users have them: pandas Series and DataFrames too, with an index of times [s]."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """Samples of a `plant` by name, with the noise `noise_std` of each.

    `kinds` are the names that show each flat output; noise is relative to that of the first of them. Of more than
    `many` samples of a name, fewer are learned from, as `centres` says; see `condensed_by_name` for `kernels`.
    """

    plant: ConstrainedSystem
    given: Mapping[str, Samples]
    kinds: list[tuple[str, ...]]
    noise_std: Noise
    centres: Centres
    many: int = MANY
    kernels: tuple[Kernel, ...] = ()

    @classmethod
    def of(
        cls,
        samples: SamplesLike,
        plant: ConstrainedSystem,
        noise_std: Noise,
        centres: Centres,
        many: int = MANY,
        kernels: tuple[Kernel, ...] = (),
    ) -> Self:
        """Return what was given, checked. Raises TypeError and ValueError, as `learn_reference` says."""
        given, centres = samples_by_name(samples, plant), checked_centres(centres)
        return cls(plant, given, names_of_each(plant, given), noise_std, centres, many, kernels)

    @cached_property
    def all(self) -> dict[str, Samples]:
        """All samples by name. ValueError: the noise of names that show one flat output is not known."""
        return with_noise(self.given, self.kinds, self.noise_std)

    @cached_property
    def fewer(self) -> dict[str, Samples]:
        """The samples to learn from, by name."""
        return self._condensed(self.all, self.centres)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The name of each flat output: of those that show it, the first."""
        return tuple(first for first, *_ in self.kinds)

    @cached_property
    def all_signals(self) -> tuple[Samples, ...]:
        """All samples of each flat output."""
        return sampled_signals(self.plant, self.all)[1]

    @cached_property
    def signals(self) -> tuple[Samples, ...]:
        """The samples to learn from, of each flat output."""
        return sampled_signals(self.plant, self.fewer)[1]

    def others(self, what: str, samples: SamplesLike) -> tuple[Samples, ...]:
        """Return other samples of each flat output; `what` names them in messages. Raises as `same_states`."""
        found = same_states(what, samples, self.plant, self.kinds, self.noise_std)
        return sampled_signals(self.plant, self._condensed(found, self.centres))[1]

    def part(self, samples: Mapping[str, Samples], centres: Centres) -> tuple[Samples, ...]:
        """Return samples of each flat output that are a part of `all`, from fewer `centres`."""
        return sampled_signals(self.plant, self._condensed(samples, centres))[1]

    def priors(self, kernel: Kernel | Mapping[str, Kernel], mean: float | Mapping[str, float]) -> dict[str, Prior]:
        """Return the prior of each flat output, by name. Raises as `priors_by_name`."""
        return priors_by_name(self.names, kernel, noise_of_first(self.noise_std, self.kinds), mean)

    def cost(self, prior: JointPrior) -> tuple[Condensation, ...]:
        """Return what it costs that fewer samples stand for all of them."""
        return cost_of(self.plant, self.all, self.fewer, prior)

    def _condensed(self, samples: Mapping[str, Samples], centres: Centres) -> dict[str, Samples]:
        return condensed_by_name(samples, self.kinds, centres, self.noise_std, self.many, self.kernels)


def names_of_each(plant: ConstrainedSystem, names: Iterable[str]) -> list[tuple[str, ...]]:
    """Return the names that show each flat output, one of its level first. ValueError as `kinds_by_name`."""
    return [tuple(shown) for shown in kinds_by_name(plant, names)]


def samples_by_name(given: SamplesLike, plant: ConstrainedSystem, what: str = "samples") -> dict[str, Samples]:
    """Return samples by the name of what is sampled. TypeError: something else was given."""
    if is_frame(given):
        return samples_of_frame(what, given)
    if isinstance(given, Samples) or is_column(given):
        return {default_sample(plant): _samples(what, given)}
    if not isinstance(given, Mapping):
        raise TypeError(
            f"{what}: expected Samples, or a mapping from names to Samples, got {type(given).__name__}; "
            "`recording.samples(name)` gives those of a recording"
        )
    return {name: _samples(what, of_name, f" of {name}") for name, of_name in given.items()}


def _samples(what: str, given: object, of: str = "") -> Samples:
    if is_column(given):
        return samples_of_column(f"{what}{of}", given)
    if not isinstance(given, Samples):
        raise TypeError(f"{what}: expected Samples(times, values){of}, got {type(given).__name__}")
    return given


def with_noise(
    samples: Mapping[str, Samples],
    kinds: Iterable[Iterable[str]],
    noise_std: Noise,
) -> dict[str, Samples]:
    """Return samples whose noise is relative to σ_n of the first name that shows the same flat output.

    `kinds` are the names that show each flat output. ValueError: several do, and their noise is not known.
    """
    shown = [tuple(names) for names in kinds]
    several = [names for names in shown if len(names) > 1]
    known = {name: _known_noise(value_of(noise_std, name, "noise_std"), names) for names in several for name in names}
    return relative_to_first(samples, shown, known)


def same_states(
    what: str,
    samples: SamplesLike,
    plant: ConstrainedSystem,
    kinds: list[tuple[str, ...]],
    noise_std: Noise,
) -> dict[str, Samples]:
    """Return other samples by name, with their relative noise; `what` names them in messages.

    ValueError: they are not of the states of the first samples, which have these `kinds`.
    """
    given = samples_by_name(samples, plant, what)
    if names_of_each(plant, given) != kinds:
        expected = ", ".join(name for shown in kinds for name in shown)
        raise ValueError(f"{what}: expected samples of {expected}, as of the first ones, got {', '.join(given)}")
    return with_noise(given, kinds, noise_std)


def noise_of_first(noise_std: T | Mapping[str, T], kinds: Iterable[Iterable[str]]) -> T | dict[str, T]:
    """Return the noise without that of other names than the first that shows a flat output."""
    if not isinstance(noise_std, Mapping):
        return noise_std
    others = {name for _, *rest in kinds for name in rest}
    return {name: value for name, value in noise_std.items() if name not in others}


def _known_noise(given: object, names: tuple[str, ...]) -> float:
    if not (is_number(given) and 0 < given < np.inf) or isinstance(given, Learned):
        raise ValueError(
            f"noise_std: must be known for each of {' and '.join(names)}, which show the same flat output in units of "
            f"their own, as {{{', '.join(f'{name!r}: 0.1' for name in names)}}}; got {given!r}"
        )
    return float(given)
