"""A learned reference with its proof, as programs and notebooks hold it, and as a file."""

import operator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np

from trackable.arrays import Array
from trackable.certificates.certificate import Certificate
from trackable.certificates.claim import OnWindow
from trackable.certificates.outcome import Counterexample, Unproved
from trackable.certificates.prove import Outcome, prove, prove_on_window
from trackable.certificates.rounding.references import LATEST
from trackable.errors import InputError, NoReferenceError
from trackable.files import read_bytes, write_atomically, write_json
from trackable.gp.joint import JointPosterior, JointPrior
from trackable.gp.prior import NOISE
from trackable.gp.samples import Samples
from trackable.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackable.learning.search import best_solution
from trackable.learning.space import SearchSpace
from trackable.systems.draws import Bands, Draws, band, bounded_steps, draws_within_bounds
from trackable.systems.flat.functional import Functional
from trackable.systems.flat.trajectory import Coordinate
from trackable.systems.reference import Reference, Window


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
        """Return x_r(k) at steps k of any shape: (*k.shape, n). ValueError for steps outside of what is proved."""
        self._refuse_unproved(k)
        return self.reference.state(k)

    def input(self, k: Array | int) -> Array:
        """Return u_r(k), which takes x_r(k) to x_r(k + 1): shape (*k.shape, m). ValueError as for states."""
        self._refuse_unproved(k)
        return self.reference.input(k)

    def window(self, k: int, horizon: int) -> Window:
        """Return states k … k + `horizon` and the inputs between them, for a predictive controller at step k.

        ValueError for steps outside of what is proved or a horizon below one step, TypeError for one that is no whole
        number.
        """
        if operator.index(horizon) < 1:
            raise ValueError(f"window: a horizon of one step at least is needed, got {horizon}")
        self._refuse_unproved(np.array([k, k + horizon]))
        return self.reference.window(k, horizon)

    def state_std(self, k: Array | int) -> Array:
        """Return the posterior standard deviation of the states at steps k, from the samples: shape (*k.shape, n)."""
        return self._std(self.reference.plant.flatness.states, self._times(k))

    def input_std(self, k: Array | int) -> Array:
        """Return that of the inputs, to first order where they are no weighted sums: shape (*k.shape, m)."""
        plant, t = self.reference.plant, self._times(k)
        if plant.allocation is None:
            return self._std(plant.flatness.inputs, t)
        each = [self._std(self.reference.inputs_near(at), np.asarray(at)) for at in t.ravel().tolist()]
        return np.array(each).reshape(*t.shape, len(plant.flatness.inputs))

    def draws(self, k: Array | int, count: int = 1000, seed: int = 0) -> Draws:
        """Return draws of states and inputs at steps k, given the samples and the bounds; the same for the same seed.

        Every draw keeps the bounds at the steps k, at up to 51 steps between the first sample and the last, and where
        the reference is at a bound; nothing is promised between these steps. Inputs of a nonlinear system are drawn to
        first order around the reference. Shapes (count, *k.shape, n) and (count, *k.shape, m).

        Raises ValueError for steps outside of what is proved and for too many of them, and NoRoom (an ArithmeticError)
        where the bounds leave nothing to draw.
        """
        self._refuse_unproved(k)
        also = bounded_steps(self.reference, self.samples, self.certificate.claim.span)
        return draws_within_bounds(self.reference, self._posterior, k, also, count, seed)

    def bands(self, k: Array | int, coverage: float = 0.95, count: int = 2000, seed: int = 0) -> Bands:
        """Return where each state and each input is at steps k with probability `coverage`: they stay in their bounds.

        The shortest intervals that hold this part of `count` draws: shapes (*k.shape, n) and (*k.shape, m), each with
        lower and upper ends. Raises ValueError and NoRoom as `draws` does.
        """
        return Bands(*(band(of, coverage) for of in self.draws(k, count, seed)))

    @property
    def hyperparameters(self) -> dict[str, float]:
        """All hyperparameters, learned and known ones, in natural units."""
        return {name: float(value) for name, value in self.prior.hyperparameters.items()}

    @property
    def misfit(self) -> dict[str, float]:
        """The root mean square of samples minus reference, by name of what is sampled and in its unit."""
        return {name: _root_mean_square(off) for name, off in self._off.items()}

    @property
    def explanation(self) -> str:
        """What is proved, and how far the reference is from its samples, in one sentence."""
        until = self.certificate.evaluated_until
        rounding = f" (evaluated in float64 up to {until:.4g} s)" if until < LATEST else ""
        return f"{self.certificate.explanation}{rounding}; {', '.join(self._distances)}"

    @property
    def _off(self) -> dict[str, Array]:
        """Samples minus what the reference says of them."""
        flat = zip(self.prior.names, self.samples, self.reference.signals, strict=True)
        return {name: of.values - of.stencil.measured(signal, of.times) for name, of, signal in flat}

    @property
    def _distances(self) -> list[str]:
        said = []
        for (name, off), of, part in zip(self._off.items(), self.samples, self.prior.parts, strict=True):
            by_noise = _root_mean_square(off / (part.noise_std * of.relative_noise))
            noise = "learned noise" if NOISE in part.learned else "noise"  # which a bad fit makes large
            said.append(
                f"it is {_root_mean_square(off):.3g} off the samples of {name}, which spread by "
                f"{np.std(of.values):.3g} (root mean squares), and {by_noise:.3g} times their {noise}"
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

    def unconstrained(self) -> Reference:
        """Learn a reference from the same samples and prior without constraints, to compare with.

        The system may be unable to follow it. Raises NotTrackableError where nothing can be learned.
        """
        space = SearchSpace.around(self.samples, self.prior)
        found = best_solution(ConstrainedProblem(self.samples, self.prior, space))
        if not isinstance(found, Solution):
            raise NotTrackableError(found)
        return Reference(found.posterior.signals, self.reference.plant)

    def save(self, path: Path | str) -> None:
        """Write everything as JSON, losslessly and atomically. Raises OSError."""
        from trackable.codec import dumps  # noqa: PLC0415  loaded for files only

        write_atomically(Path(path), dumps(SavedReference.of(self)))

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
        """Write the proof alone, for `python -m trackable check FILE`. Raises OSError."""
        from trackable.codec.certificates import encode_certificate  # noqa: PLC0415  loaded for files only

        write_json(Path(path), encode_certificate(self.certificate))

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
class SavedReference:
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


def _root_mean_square(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _read(path: Path) -> SavedReference:
    from trackable.codec import loads  # noqa: PLC0415  loaded for files only
    from trackable.codec.certificates import FORMAT  # noqa: PLC0415  loaded for files only

    content = read_bytes(path)
    if f'"format": "{FORMAT}"'.encode() in content:
        raise InputError(f"{path}: holds a certificate; what can be loaded is the reference, as `save` writes it")
    return loads(SavedReference, content)
