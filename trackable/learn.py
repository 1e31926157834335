"""From samples to a reference with a proof in one call, for notebooks and programs."""

from collections.abc import Mapping
from typing import Literal, TypeVar

import numpy as np
from tqdm import tqdm

from trackable.certificates.certified import Certified, learn_certified
from trackable.certificates.goal import Goal, for_all_times, has_period, on_window
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.base import Kernel
from trackable.gp.prior import NOISE, Prior
from trackable.gp.samples import Samples
from trackable.learning.space import SearchSpace
from trackable.reference import NotTrackableError, TrackableReference
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.sampling import default_sample, sampled_signals
from trackable.systems.sets.interval import Interval

T = TypeVar("T")

Kind = Literal["asymptotic", "periodic", "window"]


def learn_reference(
    samples: Samples | Mapping[str, Samples],
    plant: ConstrainedSystem,
    kernel: Kernel | Mapping[str, Kernel],
    kind: Kind,
    *,
    noise_std: float | Mapping[str, float] | None = None,
    mean: float | Mapping[str, float] = 0.0,
    window: tuple[float, float] | None = None,
    known: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    starts: int = 8,
    progress: bool = True,
) -> TrackableReference:
    """Learn a reference that `plant` can follow within its bounds, and prove it.

    Parameters
    ----------
    samples
        By name of the sampled state (or of a flat output, z1, z2, …): one for each flat output of the system. A system
        with one flat output takes samples of its first state without a name.
    kernel
        One for all flat outputs, or by the same names; its hyperparameters only say where nothing is learned.
    kind
        "asymptotic": for all times, with a kernel that decays; the reference comes to rest at the prior mean.
        "periodic": for all times, with periodic kernels of one period. "window": on `window` = (start, end) [s] only.
    noise_std
        σ_n of the samples where it is known; learned where it is None. Samples with a `relative_noise` multiply it.
    mean
        What is believed without samples, in the unit of the sampled states.
    known
        Hyperparameters that are not learned, by name as in `hyperparameters`.
    bounds
        (lower, upper) for learned hyperparameters, by name; from the scales of the samples where none are given.
    starts
        From how many points the search starts.
    progress
        A bar on a terminal; nothing is shown elsewhere.

    Raises
    ------
    TypeError
        For samples or kernels that are none.
    ValueError
        For samples, kernels or options that do not fit together, and for a prior mean that is no admissible equilibrium
        (where all times are asked for), with the reason.
    NotTrackableError
        Where no reference was found, or none that is proved: says by how much, where and why.

    """
    given = _given(samples, plant)
    names, seen = sampled_signals(plant, given)
    prior = _prior(names, seen, kernel, noise_std, mean, known or {}, share_period=kind == "periodic")
    goal = _goal(kind, seen, prior, plant, window)
    space = SearchSpace.around(seen, prior, {name: _interval(name, *b) for name, b in (bounds or {}).items()}, starts)
    with tqdm(desc="learn reference", unit="fit", disable=None if progress else True) as bar:
        found = learn_certified(seen, prior, plant, space, goal, lambda done: bar.update())
    if not isinstance(found, Certified):
        raise NotTrackableError(found)
    posterior = found.solution.posterior
    return TrackableReference(found.reference, found.certificate, seen, posterior.prior, found.solution.objective)


def _given(samples: Samples | Mapping[str, Samples], plant: ConstrainedSystem) -> dict[str, Samples]:
    if isinstance(samples, Samples):
        return {default_sample(plant): samples}
    if not isinstance(samples, Mapping):
        raise TypeError(
            f"samples: expected Samples, or a mapping from names to Samples, got {type(samples).__name__}; "
            "`recording.samples(name)` gives those of a recording"
        )
    for name, of_name in samples.items():
        if not isinstance(of_name, Samples):
            raise TypeError(f"samples: expected Samples(times, values) of {name}, got {type(of_name).__name__}")
    return dict(samples)


def _refuse_other_than_kernels(given: object) -> None:
    if not isinstance(given, Kernel):
        what = f"the class {given.__name__}" if isinstance(given, type) else type(given).__name__
        raise TypeError(f"kernel: expected a kernel such as SquaredExponential(1.0, 1.0), got {what}")


def _interval(name: str, lower: float, upper: float) -> Interval:
    if not lower < upper:
        raise ValueError(f"bounds: of {name} expected (lower, upper) with lower < upper, got ({lower:g}, {upper:g})")
    return Interval(lower, upper)


def _prior(
    names: tuple[str, ...],
    samples: tuple[Samples, ...],
    kernel: Kernel | Mapping[str, Kernel],
    noise_std: float | Mapping[str, float] | None,
    mean: float | Mapping[str, float],
    known: Mapping[str, float],
    *,
    share_period: bool,
) -> JointPrior:
    parts = []
    for name, of_name in zip(names, samples, strict=True):
        own = _of(kernel, name, "kernel")
        _refuse_other_than_kernels(own)
        sigma = _of(noise_std, name, "noise_std")
        stencil = of_name.stencil
        level = (_of(mean, name, "mean") - stencil.offset) / sum(stencil.weights)
        guess = float(np.std(of_name.values)) or 1.0
        fixed = frozenset({NOISE}) if sigma is not None else frozenset[str]()
        parts.append(Prior(own, sigma if sigma is not None else guess, level, fixed))
    shared = frozenset({"period"}) if share_period and len(parts) > 1 else frozenset[str]()
    return JointPrior(tuple(parts), names, shared).with_known(known)


def _of(given: T | Mapping[str, T], name: str, what: str) -> T:
    if not isinstance(given, Mapping):
        return given
    if name not in given:
        raise ValueError(f"{what}: is missing for {name}, given for {', '.join(given) or 'none'}")
    return given[name]


def _goal(
    kind: Kind,
    samples: tuple[Samples, ...],
    prior: JointPrior,
    plant: ConstrainedSystem,
    window: tuple[float, float] | None,
) -> Goal:
    if (kind == "window") != (window is not None):
        raise ValueError(f"window: is for the kind 'window' and needed there, got {window} for {kind!r}")
    if window is not None:
        return on_window(*window)
    if kind not in ("asymptotic", "periodic"):
        raise ValueError(f"kind: must be one of asymptotic, periodic, window, got {kind!r}")
    names = ", ".join(type(part.kernel).__name__ for part in prior.parts)
    if (kind == "periodic") != has_period(prior):
        wanted = "kernels must have one period" if kind == "periodic" else "kernels must decay"
        raise ValueError(f"kernel: for the kind {kind!r} {wanted}, got {names}")
    means = [part.mean for part in prior.parts]
    for quantity in plant.quantities:
        if not quantity.bounds.strictly_contains(level := quantity.at_rest(means)):
            raise ValueError(
                f"mean: must be an admissible equilibrium, but at rest there the {quantity.name} is {level:.4g}, not "
                f"inside {quantity.bounds}: fading samples could not be followed for ever"
            )
    return for_all_times(samples, prior, plant)
