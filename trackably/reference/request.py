"""Check the user's input: samples by name, a prior for each name, and a prior mean that the claim allows."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, Self, TypeVar, runtime_checkable

import numpy as np
import numpy.typing as npt

from trackably.arguments import instance, is_number, numbers, real
from trackably.checker.certificate import AllPhases, Claim, Window
from trackably.gp.factorise import LARGEST_DENSE
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.base import Kernel
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencil
from trackably.reference.condensed import Centres, Condensation, checked_centres, condense, represented
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.sampling import default_sample, kinds_by_name, sampled_signals
from trackably.systems.tightening import Tightening, require_plant
from trackably.systems.trajectories import Quantity

T = TypeVar("T")

# The prior of each sampled name: its kernel, its noise and its mean, given for all names or by name.

Noise = float | tuple[float, float] | Mapping[str, float | tuple[float, float] | None] | None
"""σ_n of samples for all names or by name: a number, an interval in which it is learned, or None (learned)."""


def _value_of(given: T | Mapping[str, T], name: str, what: str) -> T:
    """Return the value for a `name`, from one value for all names or values by name.

    ValueError, which begins with the argument's name `what`: there is no value for this name.
    """
    if not isinstance(given, Mapping):
        return given
    if name not in given:
        raise ValueError(
            f"{what}: expected a value for {name}, got values for {', '.join(map(str, given)) or 'no name'} only"
        )
    return given[name]


def _prior(name: str, kernel: Kernel, noise_std: float | tuple[float, float] | None, mean: float) -> Prior:
    instance("kernel", kernel, Kernel, "a kernel such as SquaredExponential()")
    try:
        return Prior(kernel, noise_std, real(f"mean of {name}", mean))
    except ValueError as error:
        raise ValueError(f"{error}{'' if name in str(error) else f' for {name}'}") from None


# Samples in tables with an index of times, as in pandas, which is not imported.


@runtime_checkable
class SeriesLike(Protocol):
    """Values over an index of times: a pandas Series."""

    @property
    def index(self) -> Iterable[object]: ...

    def to_numpy(self) -> npt.NDArray[np.generic]: ...


@runtime_checkable
class FrameLike(SeriesLike, Protocol):
    """Columns of values over one index of times: a pandas DataFrame."""

    @property
    def columns(self) -> Iterable[object]: ...

    def __getitem__(self, key: object, /) -> SeriesLike: ...


_SECONDS_OF_DATES = "set frame.index = (frame.index - frame.index[0]).total_seconds()"


def _samples(what: str, given: object) -> Samples:
    """Return samples, or a column's values at the times [s] of its index; values that are NaN are left out.

    Times may be durations (timedelta64). TypeError: `given` is neither, times are dates, whose zero is unknown, or the
    index only counts rows. ValueError as `Samples` raises it, for example if times are not in order.
    """
    if isinstance(given, Samples):
        return given
    if not isinstance(given, SeriesLike) or isinstance(given, FrameLike):
        raise TypeError(
            f"{what}: expected Samples(times, values), a mapping from names to such Samples, or a pandas table with "
            f"times as its index, got {type(given).__name__}; `recording.samples(name)` gives those of a recording"
        )
    if type(given.index).__name__ == "RangeIndex":
        raise TypeError(
            f"{what}: expected an index of times in seconds, got row numbers; set it by `frame.set_index(times)`"
        )
    times = np.asarray(given.index)
    if times.dtype.kind == "M" or hasattr(given.index, "tz"):
        raise TypeError(f"{what}: index: expected times in seconds, got dates; {_SECONDS_OF_DATES}")
    if times.dtype.kind == "m":
        times = times / np.timedelta64(1, "s")
    times, values = numbers(f"{what}: index", times), numbers(what, given.to_numpy())
    there = ~np.isnan(values)
    if len(there) and not there.any():
        raise ValueError(f"{what}: expected numbers, but every value is NaN")
    return Samples(times[there], values[there])


SamplesLike = Samples | SeriesLike | FrameLike | Mapping[str, Samples | SeriesLike]
"""Samples in the forms that users have, including pandas Series and DataFrames with an index of times [s]."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """Samples of a `plant`, `given` by name, with the noise `noise_std` of each name.

    `kinds` has, for each flat output, the names of the samples that depend on it, with their stencils; their noise is
    relative to that of the first name. If a name has many samples, they are replaced by fewer ones according to the
    option `centres`, whose number is multiplied by `times` (see `represented`).
    """

    plant: ConstrainedSystem
    given: Mapping[str, Samples]
    kinds: tuple[dict[str, Stencil], ...]
    noise_std: Noise
    centres: Centres
    times: int = 1

    @classmethod
    def of(cls, samples: SamplesLike, plant: ConstrainedSystem, noise_std: Noise, centres: Centres) -> Self:
        """Check the arguments, and return the measurements. TypeError and ValueError as in `learn_reference`."""
        require_plant(plant)
        given, centres = samples_by_name(samples, plant), checked_centres(centres)
        return cls(plant, given, kinds_by_name(plant, given), noise_std, centres)

    @cached_property
    def all(self) -> dict[str, Samples]:
        """All samples by name, with noise relative to that of the first name for the same flat output.

        ValueError: several names depend on one flat output, and the noise of one is unknown.
        """
        found, known = dict(self.given), self.known_noise
        for names in self.kinds:
            first, *others = names
            unknown = [name for name in names if not 0 < known.get(name, 0.0) < np.inf]
            if others and unknown:
                got = _value_of(self.noise_std, unknown[0], "noise_std")
                raise ValueError(
                    f"noise_std: expected a number for each of {' and '.join(names)}, which depend on the same flat "
                    f"output, as {dict.fromkeys(names, 0.1)}, each in the unit of its samples; got {got!r} for "
                    f"{unknown[0]}"
                )
            for name in others:
                relative = found[name].relative_noise * known[name] / known[first]
                found[name] = replace(found[name], relative_noise=relative)
        return found

    @cached_property
    def fewer(self) -> dict[str, Samples]:
        """The samples to learn from, by name: all of them, or fewer that represent them."""
        noise = {name: self.known_noise.get(first) for first, *others in self.kinds for name in (first, *others)}
        return {name: represented(of, self.centres, noise[name], self.times) for name, of in self.all.items()}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The name of each flat output: the first of the names that depend on it."""
        return tuple(first for first, *_ in self.kinds)

    @cached_property
    def known_noise(self) -> dict[str, float]:
        """σ_n of each name for which a number is given."""
        of = self.noise_std
        given = {name: of.get(name) if isinstance(of, Mapping) else of for name in self.given}
        return {
            name: float(value) for name, value in given.items() if is_number(value) and not isinstance(value, Learned)
        }

    @cached_property
    def signals(self) -> tuple[Samples, ...]:
        """The samples to learn from, joined for each flat output."""
        return sampled_signals(self.plant, self.fewer)

    def others(self, what: str, samples: SamplesLike) -> Self:
        """Return measurements of other `samples` of the same names; `what` is the argument's name in messages.

        ValueError: the samples have other names.
        """
        given = samples_by_name(samples, self.plant, what)
        if kinds_by_name(self.plant, given) != self.kinds:
            raise ValueError(
                f"{what}: expected samples of {', '.join(self.given)}, like `samples`, got {', '.join(given)}"
            )
        return replace(self, given={name: given[name] for name in self.given}, times=1)

    def learn_enough(
        self,
        learn: Callable[[tuple[Samples, ...], T | None], T],
        prior_of: Callable[[T], JointPrior],
        before: T | None = None,
    ) -> tuple[T, tuple[Condensation, ...]]:
        """Return the result of `learn` for the samples of all flat outputs, and the effect of using fewer samples.

        `learn` takes the samples and its last result. If the learned hyperparameters (`prior_of` the result) need more
        centres, it is called again with more centres.
        """
        found = learn(self.signals, before)
        enough, cost = self.enough_for(prior_of(found))
        return (found, cost) if enough is self else enough.learn_enough(learn, prior_of, found)

    def enough_for(self, prior: JointPrior) -> tuple[Self, tuple[Condensation, ...]]:
        """Return measurements with enough centres for a prior, and the effect of replacing samples by these centres.

        "auto" doubles the number of centres until the effect is small, or all samples are used. If some
        hyperparameters are still to be learned, return the same measurements and no effect.
        """
        cost = () if prior.learned else self._cost(prior)
        if self.centres != "auto" or not any(each.is_large for each in cost):
            return self, cost
        return replace(self, times=2 * self.times).enough_for(prior)

    def _cost(self, prior: JointPrior) -> tuple[Condensation, ...]:
        """Return the effect of condensing the samples of each flat output, for the hyperparameters of `prior`.

        The centres are compared with all samples if a dense covariance matrix of these is feasible, otherwise with
        twice as many centres.
        """
        most = LARGEST_DENSE // max(1, len(self.given) - self.plant.signal_count + 1)
        more = {
            name: of if len(of) <= most else condense(of, 2 * len(self.fewer[name])) for name, of in self.all.items()
        }
        parts = zip(self.names, prior.parts, self.signals, sampled_signals(self.plant, more), strict=True)
        return tuple(Condensation.of(name, part, one, other) for name, part, one, other in parts if one.scatter.count)

    def priors(self, kernel: Kernel | Mapping[str, Kernel], mean: float | Mapping[str, float]) -> dict[str, Prior]:
        """Return the prior of each flat output, by name.

        TypeError or ValueError, with the name concerned: a value is invalid, missing, or given for another name.
        """
        noise_std = self.noise_std
        if isinstance(noise_std, Mapping):
            others = {name for _, *rest in self.kinds for name in rest}
            noise_std = {name: value for name, value in noise_std.items() if name not in others}
        for what, given in (("kernel", kernel), ("noise_std", noise_std), ("mean", mean)):
            if isinstance(given, Mapping) and set(self.names) < set(given):  # other names would be ignored silently
                unknown = next(name for name in given if name not in self.names)
                raise ValueError(f"{what}: got a value for {unknown}, expected values for {', '.join(self.names)} only")
        return {
            name: _prior(
                name,
                _value_of(kernel, name, "kernel"),
                _value_of(noise_std, name, "noise_std"),
                _value_of(mean, name, "mean"),
            )
            for name in self.names
        }


def samples_by_name(given: SamplesLike, plant: ConstrainedSystem, what: str = "samples") -> dict[str, Samples]:
    """Return samples by the sampled name. TypeError: `given` is no form of samples that is accepted."""
    if isinstance(given, FrameLike):
        given = {str(name): given[name] for name in given.columns}
    if isinstance(given, Mapping):
        return {name: _samples(f"{what} of {name}", of_name) for name, of_name in given.items()}
    found = _samples(what, given)
    return {default_sample(plant): found}


# The prior mean: if all times are claimed, it has to be an equilibrium within the bounds.


def quantities_at_rest(claim: Claim, plant: ConstrainedSystem) -> tuple[Quantity, ...]:
    """Return the quantities that have to keep their bounds while the plant rests at the prior mean, for this claim."""
    # For free claims, the prior mean need not keep any bound. A vehicle may move for ever with a periodic kernel; with
    # a kernel that decays, it comes to rest at the prior mean.
    is_free = isinstance(claim, Window) or (plant.flat_form and isinstance(claim, AllPhases))
    return () if is_free else plant.quantities


def check_rest(
    prior: JointPrior, at_rest: Iterable[Quantity], tightening: Tightening | None, why: str, or_else: str = ""
) -> None:
    """Raise ValueError if a quantity leaves its bounds while the plant rests at the prior mean.

    The message says `why` the mean has to be an equilibrium, and what to do instead (`or_else`). `tightening` is None,
    or how the bounds were tightened.
    """
    means = [part.mean for part in prior.parts]
    for quantity in at_rest:
        bounds = quantity.bounds.rest
        level = bounds.snapped(quantity.at_rest(means))
        if not bounds.strictly_contains(level):
            place = "on a bound of" if level in {bounds.lower, bounds.upper} else "not inside"
            left = "; these bounds are tightened for disturbance, noise and margin" if tightening else ""
            raise ValueError(
                f"mean: must be an admissible equilibrium, but at rest there the {quantity.name} is "
                f"{level + 0.0:.9g}, {place} {bounds}: {why}; give a mean for which it is inside, by a millionth "
                f"of the width at least, or a pair between which it is learned{or_else and f', or {or_else}'}{left}"
            )
