"""What a user asks of `learn_reference`, checked where it enters: samples, priors, claim."""

from collections.abc import Iterable, Mapping
from typing import TypeVar

import numpy as np

from trackable.arguments import instance, is_number, real
from trackable.arrays import ArrayLike
from trackable.certificates.goal import Claim, Goal, goal_for
from trackable.gp.hyperparameter import Learned
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.base import Kernel
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.disturbance.sets import DisturbanceSet
from trackable.systems.disturbance.tightening import Tightening, tightening
from trackable.systems.frames import Column, Frame, is_column, is_frame, samples_of_column, samples_of_frame
from trackable.systems.quantity import Quantity
from trackable.systems.sampling import default_sample, kinds_by_name, relative_to_first

T = TypeVar("T")

SamplesLike = Samples | Column | Frame | Mapping[str, Samples | Column]
"""Samples as users have them: pandas Series and DataFrames too, with an index of times [s]."""


def checked_plant(plant: object) -> None:
    """Raise TypeError for anything but a system with its sets."""
    instance("plant", plant, ConstrainedSystem, "a ConstrainedSystem(system, state_set, input_set)")


def tightened(
    plant: ConstrainedSystem,
    disturbance: DisturbanceSet | None,
    feedback: ArrayLike | None,
    margin: float,
    noise: DisturbanceSet | None,
) -> Tightening | None:
    """Return the plant with its bounds drawn in; None where nothing asks for it. Raises as `tightening`."""
    found = tightening(plant, disturbance, feedback, margin, noise)
    return found if found.margin or found.invariant is not None else None


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


def priors_by_name(
    names: Iterable[str],
    kernel: Kernel | Mapping[str, Kernel],
    noise_std: float | tuple[float, float] | Mapping[str, float | tuple[float, float] | None] | None,
    mean: float | Mapping[str, float],
) -> dict[str, Prior]:
    """Return the prior of each name. TypeError or ValueError says of which name something is wrong, or missing."""
    names = tuple(names)
    for what, given in (("kernel", kernel), ("noise_std", noise_std), ("mean", mean)):
        _refuse_unknown(what, given, names)
    return {name: _prior(name, _of(kernel, name, "kernel"), _of(noise_std, name, "noise_std"), _of(mean, name, "mean"))
            for name in names}  # fmt: skip


def with_noise(
    samples: Mapping[str, Samples],
    kinds: Iterable[Iterable[str]],
    noise_std: float | tuple[float, float] | Mapping[str, float | tuple[float, float] | None] | None,
) -> dict[str, Samples]:
    """Return samples whose noise is relative to σ_n of the first name that shows the same flat output.

    `kinds` are the names that show each flat output. ValueError: several do, and their noise is not known.
    """
    shown = [tuple(names) for names in kinds]
    several = [names for names in shown if len(names) > 1]
    known = {name: _known_noise(_of(noise_std, name, "noise_std"), names) for names in several for name in names}
    return relative_to_first(samples, shown, known)


def same_states(
    what: str,
    samples: SamplesLike,
    plant: ConstrainedSystem,
    kinds: list[tuple[str, ...]],
    noise_std: float | tuple[float, float] | Mapping[str, float | tuple[float, float] | None] | None,
) -> dict[str, Samples]:
    """Return other samples by name, with their relative noise; `what` names them in messages.

    ValueError: they are not of the states of the first samples, which have these `kinds`.
    """
    given = samples_by_name(samples, plant, what)
    if [tuple(shown) for shown in kinds_by_name(plant, given)] != kinds:
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


def claimed(claim: object) -> Claim:
    """Return a claim, a window as two floats. ValueError: anything else."""
    match claim:
        case str("all_times") | str("all_phases"):
            return claim
        case tuple((start, end)) if (
            is_number(start) and is_number(end) and np.isfinite([float(start), float(end)]).all()
        ):
            if not start < end:
                raise ValueError(f"claim: a window needs start < end, got [{start!r}, {end!r}]")
            return float(start), float(end)
    raise ValueError(f"claim: expected 'all_times', 'all_phases' or (start, end) in seconds, got {claim!r}")


def checked_goal(claim: Claim, samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    """Return the goal of a claim. ValueError: it does not suit the kernels, or the mean cannot be followed for ever."""
    goal = goal_for(claim, samples, prior, plant)
    means = [part.mean for part in prior.parts]
    # A vehicle may move for ever: it has to come to rest only where the kernel decays.
    fades = not isinstance(claim, tuple) and not (plant.flat_form and claim == "all_phases")
    for quantity in plant.quantities if fades else ():
        if not quantity.bounds.strictly_contains(level := quantity.at_rest(means)):
            raise ValueError(f"mean: must be an admissible equilibrium, but at rest there {_placed(quantity, level)}")
    return goal


def _placed(quantity: Quantity, level: float) -> str:
    """Say where a quantity at rest lies: on a bound of it, or outside of them."""
    at, bounds = f"the {quantity.name} is {quantity.bounds.shown(level)}", quantity.bounds
    if level in {bounds.lower, bounds.upper}:
        return (
            f"{at}, on a bound of {bounds}: a reference that fades to it has in the end no margin, and rounding alone "
            "needs one; widen this bound or move the mean inside, if only by a millionth of the width, or claim a "
            "window (start, end)"
        )
    return f"{at}, not inside {bounds}: fading samples could not be followed for ever"


def _prior(name: str, kernel: object, noise_std: float | tuple[float, float] | None, mean: float) -> Prior:
    if not isinstance(kernel, Kernel):
        what = f"the class {kernel.__name__}" if isinstance(kernel, type) else type(kernel).__name__
        raise TypeError(f"kernel: expected a kernel such as SquaredExponential(), got {what}")
    try:
        return Prior(kernel, noise_std, real(f"mean of {name}", mean))
    except ValueError as error:
        raise ValueError(f"{error}{'' if name in str(error) else f' for {name}'}") from None


def _of(given: T | Mapping[str, T], name: str, what: str) -> T:
    if not isinstance(given, Mapping):
        return given
    if name not in given:
        raise ValueError(f"{what}: is missing for {name}, given for {', '.join(map(str, given)) or 'none'}")
    return given[name]


def _refuse_unknown(what: str, given: object, names: tuple[str, ...]) -> None:
    """A value for a name that is not sampled would be forgotten without a word."""
    if isinstance(given, Mapping) and set(names) < set(given):
        unknown = next(name for name in given if name not in names)
        raise ValueError(f"{what}: is given for {unknown}, expected for {', '.join(names)} only")
