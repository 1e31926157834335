"""A learned reference with its proof, as programs and notebooks hold it, and as a file."""

from abc import abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self, overload

from trackably.certificates.certificate import Certificate
from trackably.checker.certificate import AllTimes, Window
from trackably.files import new_file, path_of
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.learning.problem import ActiveBound, Method
from trackably.reference.explanation import (
    costs,
    distances,
    given_values,
    ignores_samples,
    kept_free,
    leaves_last_samples,
    means,
    search_limits,
)
from trackably.reference.fit import Fit, Misfit
from trackably.reference.proved import ProvedReference
from trackably.reference.saved import Saved, SavedReference, Unchecked, checked_within
from trackably.reference.truth import Accuracy, accuracy
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening


@dataclass(frozen=True, eq=False, repr=False)
class LearnedReference(ProvedReference):
    """A proved reference that was learned from samples.

    `saved` is what was learned, in the `form` of the reference's file: its samples, its prior, and how the bounds of
    the plant were tightened. `pin_certificates` prove the waypoints (values asked for at single times), one certificate
    for each time.
    """

    form: ClassVar[type[Saved]]

    saved: Saved
    certificate: Certificate
    pin_certificates: tuple[Certificate, ...] = ()

    @classmethod
    def of(
        cls, certificate: Certificate, proofs: tuple[Certificate, ...], tightening: Tightening | None, **learned: Any
    ) -> Self:
        """Return the reference with its proofs; what was learned is given by the names of fields of its `form`.

        NotTrackableError and ValueError as for the class.
        """
        start, end = certificate.claim.span if isinstance(certificate.claim, Window) else (None, None)
        truth = certificate.truth or None
        saved = cls.form(**learned, proved_from=start, proved_until=end, tightening=tightening, truth=truth)
        return cls(saved, certificate, proofs)

    @property
    @abstractmethod
    def prior(self) -> JointPrior:
        """The prior of the flat outputs, with the learned hyperparameters."""

    @property
    @abstractmethod
    def misfits(self) -> tuple[Misfit, ...]:
        """The differences between samples and reference, for each sampled name."""

    @property
    def reference(self) -> Reference:
        """The reference itself, at all times."""
        return self.saved.reference

    @property
    def tightening(self) -> Tightening | None:
        """How the plant's bounds were tightened, for disturbances or by a margin; `reference` keeps these."""
        return self.saved.tightening

    @property
    def hyperparameters(self) -> dict[str, float]:
        """All hyperparameters, learned and given, in natural units."""
        return {name: float(value) for name, value in self.prior.hyperparameters.items()}

    @property
    def misfit(self) -> dict[str, float]:
        """The root mean square of samples minus reference, by the sampled name and in its unit."""
        return {misfit.name: misfit.size for misfit in self.misfits}

    def accuracy(self, name: str | None = None) -> Accuracy:
        """Return bounds of the distance between a state and its true signal: the proved one, and the least possible.

        Without a name, it is the first state with a `truth`. ValueError: no `truth` was given for this state.
        """
        return accuracy(self.certificate, name)

    @overload
    @classmethod
    def load(cls, path: Path | str) -> Self: ...

    @overload
    @classmethod
    def load(cls, path: Path | str, seconds: float | None) -> Self | Unchecked[Self]: ...

    @classmethod
    def load(cls, path: Path | str, seconds: float | None = None) -> Self | Unchecked[Self]:
        """Read a file that `save` wrote, and prove and check the reference again.

        Return Unchecked if that takes longer than `seconds`.

        Raises InputError if the file cannot be read or holds a certificate, CodecError if `save` did not write it or it
        is damaged, and NotTrackableError if the reference cannot be proved to keep its bounds.
        """
        saved = cls.form.read(path := path_of("load", path))
        return checked_within(seconds, path, lambda: cls(saved, *saved.proofs()))

    def save(self, path: Path | str) -> None:
        """Write what was learned to a JSON file, without loss. Raises OSError."""
        self.saved.write(new_file("save", path))

    def __repr__(self) -> str:
        theta = ", ".join(f"{name} = {value:.4g}" for name, value in self.hyperparameters.items())
        return f"{type(self).__name__}({theta}; {self.explanation}; {self.identity})"


@dataclass(frozen=True, eq=False, repr=False)
class TrackableReference(LearnedReference):
    """A learned reference with its proof: the system can follow it at all times that `certificate` names.

    `fit` holds what it was learned from, and what its bounds cost. Methods raise ValueError for steps k outside of the
    proved times, and for |k T_s| > `certificate.last_time`; `reference` has values at these steps too, but without
    guarantee.
    """

    form = SavedReference

    saved: SavedReference

    @property
    def fit(self) -> Fit:
        """What was learned, and what the bounds cost."""
        return self.saved.fit

    @property
    def plant(self) -> ConstrainedSystem:
        """The plant with the bounds that were given; `reference.plant` has the tightened ones."""
        return self.tightening.given if self.tightening else self.reference.plant

    @property
    def samples(self) -> tuple[Samples, ...]:
        """The samples of each flat output that were learned from; of many samples, fewer ones that represent them."""
        return self.fit.samples

    @property
    def sampled(self) -> dict[str, Samples]:
        """The samples by the name of the state or flat output that was sampled."""
        return {misfit.name: misfit.samples for misfit in self.fit.misfits}

    @property
    def prior(self) -> JointPrior:
        """The prior of the flat outputs, with the learned hyperparameters."""
        return self.fit.prior

    @property
    def misfits(self) -> tuple[Misfit, ...]:
        """The differences between samples and reference for each sampled name, also for the fit without bounds."""
        return self.fit.misfits

    @property
    def objective(self) -> float:
        """J = l(θ) + D(θ) at the optimum, with l = −2 ln p(y), and D the cost of the bounds."""
        return self.fit.objective

    @property
    def method(self) -> Method:
        """What was optimised: "joint" (the function together with the hyperparameters), or "hyperparameters" alone.

        It is "hyperparameters" also if no learned function had a smaller J than a posterior mean within the bounds.
        """
        return self.fit.method

    @property
    def price(self) -> float:
        """The cost of the guarantee: J minus the least l found without bounds, in the unit of l = −2 ln p."""
        return self.fit.price

    @property
    def duality_gap(self) -> float:
        """An upper bound of the amount by which another function within the bounds may lower J.

        It is for the same hyperparameters; if bounded quantities are nonlinear formulas, it holds to first order.
        """
        return self.fit.duality_gap

    @property
    def active_bounds(self) -> tuple[ActiveBound, ...]:
        """The bounds that the reference touches, with their times, multipliers and prices."""
        return self.fit.active_bounds

    @property
    def unconstrained_misfit(self) -> dict[str, float]:
        """The root mean square of samples minus the fit without bounds, by the sampled name and in its unit."""
        return {misfit.name: misfit.size_unconstrained for misfit in self.fit.misfits}

    @property
    def explanation(self) -> str:
        """A text that says what is proved, how far the reference is from its samples, and what its bounds cost."""
        fit = self.fit
        said = [
            ignores_samples(fit),
            self.certificate.explanation,
            kept_free(self.tightening),
            *given_values(fit.pinned),
            *means(fit.prior, fit.samples, fit.unconstrained_prior),
            *(leaves_last_samples(fit) if isinstance(self.certificate.claim, AllTimes) else ()),
            f"learned {'; '.join(map(str, fit.condensed))}" if fit.condensed else None,
            *distances(fit),
            costs(fit),
            *search_limits(fit),
        ]
        return "; ".join(filter(None, said))

    def unconstrained(self) -> Reference:
        """Return the reference of least l without bounds, for comparison: the system may be unable to follow it."""
        return self.fit.unconstrained
