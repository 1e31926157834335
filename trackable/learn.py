"""From samples to a reference with a proof in one call, for notebooks and programs."""

import warnings
from collections.abc import Mapping
from typing import TypeVar

import numpy as np

from trackable.certificates.certified import Certified, learn_certified
from trackable.certificates.goal import Claim, Goal, goal_for
from trackable.certificates.pinned import Pinned, prove_pinned
from trackable.explanation import IgnoresSamplesWarning, ignored
from trackable.fit import Fit
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.base import Kernel
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples
from trackable.learning.learner import HYPERPARAMETERS, JOINT, Learner
from trackable.learning.prior import prior_for
from trackable.learning.problem import ConstrainedProblem, Moved, Solution
from trackable.learning.search import best_solution
from trackable.learning.space import SearchSpace
from trackable.reference import NotTrackableError, TrackableReference
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.sampling import default_sample, sampled_signals
from trackable.waypoints import Waypoints, waypoints

T = TypeVar("T")

_LEARNERS: dict[str, Learner] = {"joint": JOINT, "hyperparameters": HYPERPARAMETERS}


def learn_reference(
    samples: Samples | Mapping[str, Samples],
    plant: ConstrainedSystem,
    kernel: Kernel | Mapping[str, Kernel],
    claim: Claim,
    *,
    noise_std: float | tuple[float, float] | Mapping[str, float | tuple[float, float] | None] | None = None,
    mean: float | Mapping[str, float] = 0.0,
    method: Moved = "joint",
    at: Waypoints | None = None,
    at_tolerance: float | Mapping[str, float] | None = None,
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
        One for all flat outputs, or by the same names. Each hyperparameter is a number (known), a pair (learned in this
        interval), or left out (learned in an interval chosen from the samples).
    claim
        What is proved. "all_times": every time t ≥ 0, with kernels that decay; the reference comes to rest at the prior
        mean. "all_phases": every time, with periodic kernels of one period. (start, end): the times between, in
        seconds.
    noise_std
        σ_n of the samples, given as a hyperparameter is. The `relative_noise` of samples multiplies it.
    mean
        The prior mean, in the unit of the sampled states.
    method
        What is learned. "joint": function and hyperparameters together, so that J = l + D is least; l = −2 ln p(y) of
        the samples, and D is what the bounds cost. "hyperparameters": these alone, so that the posterior mean keeps the
        bounds, as in the paper. The `method` of what is returned says which was taken: the second also where "joint"
        finds no function with a smaller J.
    at
        Values of states and inputs, by name, that the reference has at times [s]: {0.0: {"position": -0.08, "velocity":
        0.0}} begins at a plant's present state, at rest. Only function and hyperparameters together can meet them.
    at_tolerance
        By how much these values may be missed, in their unit, for all names or by name; it is proved, by a certificate
        for each time. Left out, it is 1e-4 of the width of what bounds the state or input.
    starts
        The number of points from which the search starts.
    progress
        Whether a bar is shown on a terminal; nothing is shown elsewhere.

    Warns
    -----
    IgnoresSamplesWarning
        Where the reference keeps its bounds, but does not follow its samples: it is off by more than 3 times what it
        would be without bounds, by more than the noise, and by more than a tenth of the samples' spread.

    Raises
    ------
    TypeError
        Where samples or kernels are of another type.
    ValueError
        Where samples, kernels, claim and options do not fit together, and where the prior mean is no admissible
        equilibrium though all times are claimed. Also where a value of `at` is outside of its set, or a time outside of
        the claim.
    NotTrackableError
        Where no reference was found, or none that is proved: the message says by how much, where and why. Also where
        values of `at` and bounds contradict each other: it says which.

    """
    from tqdm import tqdm  # noqa: PLC0415  loading the library shall not take longer for a bar

    learner, given = _learner(method), _given(samples, plant)
    if at and method != "joint":
        raise ValueError('at: values at given times need method="joint": hyperparameters alone cannot meet them')
    names, seen = sampled_signals(plant, given)
    believed = {
        name: Prior(_kernel(kernel, name), _of(noise_std, name, "noise_std"), _of(mean, name, "mean")) for name in names
    }
    shared = frozenset({"period"}) if claim == "all_phases" and len(names) > 1 else frozenset[str]()
    prior = prior_for(plant, believed, shared)
    goal = _goal(claim, seen, prior, plant)
    space = SearchSpace.around(seen, prior, starts)
    pinned = waypoints(at or {}, at_tolerance, plant, claim)
    pins = tuple(pin for values in pinned for pin in values.pins(plant))
    with tqdm(desc="learn reference", unit="fit", disable=None if progress else True) as bar:
        found = learn_certified(seen, prior, plant, space, goal, lambda done: bar.update(), learner, pins)
    if not isinstance(found, Certified):
        raise NotTrackableError(found)
    proofs = prove_pinned(found.reference, pinned)
    if not isinstance(proofs, tuple):
        raise NotTrackableError(proofs)
    fit = _fit(found, ConstrainedProblem(seen, prior, space), pinned)
    learned = TrackableReference(fit, found.certificate, proofs)
    if sentence := ignored(learned.fit):
        warnings.warn(sentence, IgnoresSamplesWarning, stacklevel=2)
    return learned


def _learner(method: Moved) -> Learner:
    if method not in _LEARNERS:
        raise ValueError(f"method: expected {' or '.join(map(repr, _LEARNERS))}, got {method!r}")
    return _LEARNERS[method]


def _fit(found: Certified, unconstrained: ConstrainedProblem, pinned: tuple[Pinned, ...]) -> Fit:
    """Return the fit, beside the solution of the unconstrained problem, which most learners know already."""
    solution = found.solution
    if solution.unconstrained is not None:
        return Fit.of(found.reference, solution, solution.unconstrained, pinned)
    free = best_solution(unconstrained)
    least = free.posterior if isinstance(free, Solution) else solution.posterior
    return Fit.of(found.reference, solution, least, pinned)


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


def _kernel(given: Kernel | Mapping[str, Kernel], name: str) -> Kernel:
    kernel: object = _of(given, name, "kernel")
    if not isinstance(kernel, Kernel):
        what = f"the class {kernel.__name__}" if isinstance(kernel, type) else type(kernel).__name__
        raise TypeError(f"kernel: expected a kernel such as SquaredExponential(), got {what}")
    return kernel


def _of(given: T | Mapping[str, T], name: str, what: str) -> T:
    if not isinstance(given, Mapping):
        return given
    if name not in given:
        raise ValueError(f"{what}: is missing for {name}, given for {', '.join(given) or 'none'}")
    return given[name]


def _is_window(claim: object) -> bool:
    return isinstance(claim, tuple) and len(claim) == 2 and bool(np.all(np.isfinite(claim)))


def _goal(claim: Claim, samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    if claim not in ("all_times", "all_phases") and not _is_window(claim):
        raise ValueError(f"claim: expected 'all_times', 'all_phases' or (start, end) in seconds, got {claim!r}")
    goal = goal_for(claim, samples, prior, plant)
    means = [part.mean for part in prior.parts]
    for quantity in () if _is_window(claim) else plant.quantities:
        if not quantity.bounds.strictly_contains(level := quantity.at_rest(means)):
            raise ValueError(
                f"mean: must be an admissible equilibrium, but at rest there the {quantity.name} is {level:.4g}, not "
                f"inside {quantity.bounds}: fading samples could not be followed for ever"
            )
    return goal
