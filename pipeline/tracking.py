"""From samples to a reference with a proof in one call, for notebooks and programs."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, Self, TypeVar

import numpy as np
from tqdm import tqdm

from pipeline.arrays import Array
from pipeline.certificates.certificate import FORMAT, Certificate
from pipeline.certificates.certified import Certified, learn_certified
from pipeline.certificates.claim import OnWindow
from pipeline.certificates.goal import Goal, for_all_times, has_period, on_window
from pipeline.certificates.outcome import Counterexample, Unproved
from pipeline.certificates.prove import Outcome, prove, prove_on_window
from pipeline.certificates.rounding import LATEST
from pipeline.codec import dumps, loads
from pipeline.errors import InputError, NoReferenceError
from pipeline.files import read_bytes, write_atomically, write_json
from pipeline.gp.joint import JointPosterior, JointPrior
from pipeline.gp.kernel import Kernel
from pipeline.gp.prior import NOISE, Prior
from pipeline.gp.samples import Samples
from pipeline.learning.problem import NoSolution
from pipeline.learning.space import SearchSpace
from pipeline.systems.constrained import ConstrainedSystem
from pipeline.systems.functional import Functional
from pipeline.systems.interval import Interval
from pipeline.systems.reference import Reference, Window
from pipeline.systems.sampling import default_sample, sampled_signals
from pipeline.systems.trajectory import Coordinate

T = TypeVar("T")

Kind = Literal["asymptotic", "periodic", "window"]


class NotTrackableError(NoReferenceError):
    """No certified reference was found; `outcome` says by how much, where and why."""

    def __init__(self, outcome: NoSolution | Counterexample | Unproved) -> None:
        super().__init__(outcome.explanation)
        self.outcome = outcome


@dataclass(frozen=True, eq=False)
class TrackableReference:
    """A learned reference with its proof: the system can follow it at all times that `certificate` names.

    `samples` and the learned `prior` are those of the flat outputs; `objective` is l(θ) = −2 ln p(y) at the optimum.
    Steps outside of what is proved are refused with a ValueError; `reference` has values there too, but no guarantee.
    """

    reference: Reference
    certificate: Certificate
    samples: tuple[Samples, ...]
    prior: JointPrior
    objective: float

    def state(self, k: Array | int) -> Array:
        """x_r(k) at steps k (any shape): shape (*k.shape, n)."""
        self._refuse_unproved(k)
        return self.reference.state(k)

    def input(self, k: Array | int) -> Array:
        """u_r(k), which takes x_r(k) to x_r(k + 1): shape (*k.shape, m)."""
        self._refuse_unproved(k)
        return self.reference.input(k)

    def window(self, k: int, horizon: int) -> Window:
        """States k … k + `horizon` and the inputs between them, for a predictive controller at step k."""
        if horizon < 1:
            raise ValueError(f"window: a horizon of one step at least is needed, got {horizon}")
        self._refuse_unproved(np.array([k, k + horizon]))
        return self.reference.window(k, horizon)

    def state_std(self, k: Array | int) -> Array:
        """Standard deviation of the signals behind the states at steps k, as the samples leave it: (*k.shape, n)."""
        return self._std(self.reference.plant.flatness.states, self._times(k))

    def input_std(self, k: Array | int) -> Array:
        """The same of the inputs, to first order where they are no weighted sums: (*k.shape, m)."""
        plant, t = self.reference.plant, self._times(k)
        if plant.allocation is None:
            return self._std(plant.flatness.inputs, t)
        each = [self._std(self.reference.inputs_near(at), np.asarray(at)) for at in t.ravel().tolist()]
        return np.array(each).reshape(*t.shape, len(plant.flatness.inputs))

    @property
    def hyperparameters(self) -> dict[str, float]:
        """Learned and known ones, in natural units."""
        return self.prior.hyperparameters

    @property
    def misfit(self) -> dict[str, float]:
        """By name, how far samples lie from the reference: root mean square, in the unit of what is sampled."""
        return {name: float(np.sqrt(np.mean(off**2))) for name, off in self._off.items()}

    @property
    def explanation(self) -> str:
        """What is proved, in a sentence, and what that costs: how far the reference is from its samples."""
        until = self.certificate.evaluated_until
        rounding = f" (evaluated in float64 up to {until:.4g} s)" if until < LATEST else ""
        return f"{self.certificate.explanation}{rounding}; {', '.join(self._distances)}"

    @property
    def _off(self) -> dict[str, Array]:
        """Samples minus what the reference says of them."""
        flat = zip(self.prior.names, self.samples, self.reference.signals, strict=True)
        return {name: of.values - of.stencil.seen(signal, of.times) for name, of, signal in flat}

    @property
    def _distances(self) -> list[str]:
        said = []
        for (name, off), of, part in zip(self._off.items(), self.samples, self.prior.parts, strict=True):
            by_noise = np.sqrt(np.mean((off / (part.noise_std * of.relative_noise)) ** 2))
            said.append(
                f"it is {self.misfit[name]:.3g} off the samples of {name} (root mean square), {by_noise:.3g} times "
                "their noise"
            )
        return said

    def _refuse_unproved(self, k: Array | int) -> None:
        steps = np.asarray(k, dtype=float)
        (first, last), t = self.certificate.claim.span, self._times(k)
        hair = 1e-12 * np.abs(t)
        if (outside := ~((t >= first - hair) & (t <= last + hair))).any():
            step, when = steps[outside].ravel()[0], t[outside].ravel()[0]
            raise ValueError(
                f"step {step:g} ({when:g} s) is outside of what is proved, {self.certificate.claim}; the field "
                "`reference` has values there too, without any guarantee"
            )

    def save(self, path: Path | str) -> None:
        """Write everything as JSON, losslessly and atomically. Raises OSError."""
        write_atomically(Path(path), dumps(_Saved.of(self)))

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """The inverse of `save`: what is read is proved again.

        Raises InputError where the file cannot be read or holds a certificate, CodecError where it is not what `save`
        wrote, and NotTrackableError where it holds a reference that cannot be proved to keep its bounds.
        """
        saved = _read(Path(path))
        found = saved.proof()
        if not isinstance(found, Certificate):
            raise NotTrackableError(found)
        return cls(saved.reference, found, saved.samples, saved.prior, saved.objective)

    def save_certificate(self, path: Path | str) -> None:
        """Write the proof alone, for `python -m pipeline check`. Raises OSError."""
        write_json(Path(path), self.certificate.to_dict())

    @cached_property
    def _posterior(self) -> JointPosterior:
        return JointPosterior(self.prior, self.samples)

    def _times(self, k: Array | int) -> Array:
        return np.asarray(self.reference.instants(k), dtype=float)

    def _std(self, coordinates: tuple[Coordinate, ...], t: Array) -> Array:
        variances = [self._variance(q, t) for q in coordinates]
        return np.asarray(np.sqrt(np.stack(np.broadcast_arrays(*variances), axis=-1)))

    def _variance(self, q: Coordinate, t: Array) -> Array:
        """Of formulas to first order, with other weights at each time."""
        if isinstance(q, Functional):
            return self._posterior.variance_of(q.rounded, t, q.sampling_time)
        each = [
            self._posterior.variance_of(q.weights_at(self.reference.signals, at), at, q.sampling_time)
            for at in t.reshape(-1, 1)
        ]
        return np.array(each).reshape(t.shape)

    def __repr__(self) -> str:
        theta = ", ".join(f"{name} = {value:.4g}" for name, value in self.hyperparameters.items())
        return f"TrackableReference({theta}; {self.explanation})"


@dataclass(frozen=True, eq=False)
class _Saved:
    """A file's content: `proved_from` and `proved_until` [s] for a window only."""

    reference: Reference
    samples: tuple[Samples, ...]
    prior: JointPrior
    objective: float
    proved_from: float | None
    proved_until: float | None

    @classmethod
    def of(cls, found: TrackableReference) -> Self:
        claim = found.certificate.claim
        ends = (claim.start, claim.end) if isinstance(claim, OnWindow) else (None, None)
        return cls(found.reference, found.samples, found.prior, found.objective, *ends)

    def proof(self) -> Outcome:
        if self.proved_from is None or self.proved_until is None:
            return prove(self.reference)
        return prove_on_window(self.reference, self.proved_from, self.proved_until)


def _read(path: Path) -> _Saved:
    content = read_bytes(path)
    if f'"format": "{FORMAT}"'.encode() in content:
        raise InputError(f"{path}: holds a certificate; what can be loaded is the reference, as `save` writes it")
    return loads(_Saved, content)


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
        if not quantity.bounds.holds_inside(level := quantity.at_rest(means)):
            raise ValueError(
                f"mean: must be an admissible equilibrium, but at rest there the {quantity.name} is {level:.4g}, not "
                f"inside {quantity.bounds}: fading samples could not be followed for ever"
            )
    return for_all_times(samples, prior, plant)
