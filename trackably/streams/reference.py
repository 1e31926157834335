"""A reference learned window by window, with a proof of the whole.

It is saved with all data that it was learned from; when it is read, it is proved again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.reference.condensed import Condensation
from trackably.reference.explanation import given_values, kept_free, means
from trackably.reference.fit import Misfit, residual
from trackably.reference.saved import Saved
from trackably.reference.trackable import LearnedReference
from trackably.reference.waypoints import Waypoint
from trackably.systems.reference import Reference


@dataclass(frozen=True, eq=False)
class SavedStream(Saved):
    """A reference `learned` in windows of a `length` [s] from `samples`.

    `condensed` is the effect of replacing the given samples by fewer ones, and `pinned` are the waypoints.

    ValueError: there is not one prior, one learned signal and one set of samples for each flat output, a
    hyperparameter is not known, or the length is not positive; and as for `Saved`.
    """

    learned: Reference
    samples: tuple[Samples, ...]
    prior: JointPrior
    length: float
    condensed: tuple[Condensation, ...] = ()
    pinned: tuple[Waypoint, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        counts = {len(self.samples), len(self.prior.parts), len(self.learned.kernel_sums)}
        if len(counts) > 1 or self.prior.learned or not self.length > 0:
            raise ValueError(
                "stream: expected samples, a prior and a learned signal for each flat output, known hyperparameters "
                f"and length > 0, got {len(self.samples)} of the first, {len(self.prior.parts)} of the second, "
                f"{len(self.learned.kernel_sums)} of the third, {len(self.prior.learned)} hyperparameters to learn "
                f"and length = {self.length:g}"
            )

    @property
    def reference(self) -> Reference:
        return self.learned

    @property
    def waypoints(self) -> tuple[Waypoint, ...]:
        return self.pinned


@dataclass(frozen=True, eq=False, repr=False)
class StreamReference(LearnedReference):
    """One reference for a whole stream: the system can follow it at all times that `certificate` claims.

    The signals are one sum of kernels, to which each window has added, and the proof is about the sum; so there are no
    transitions between windows.
    """

    form = SavedStream

    saved: SavedStream

    @property
    def samples(self) -> tuple[Samples, ...]:
        """The samples of the flat outputs; if they were condensed, the fewer ones that represent them."""
        return self.saved.samples

    @property
    def prior(self) -> JointPrior:
        """The prior of the flat outputs; hyperparameters are known, or learned from the window with most motion."""
        return self.saved.prior

    @property
    def explanation(self) -> str:
        """The proved statement, how the reference was learned, and its distance from the samples."""
        off = [
            f"it is {misfit.size:.3g} off the samples of {misfit.name} (root mean square), {misfit.in_noise:.3g} times "
            "their noise"
            for misfit in self.misfits
        ]
        saved = self.saved
        learned = f"learned in windows of {saved.length:g} s, each of which continues the one before"
        said = [self.certificate.explanation, kept_free(self.tightening), *given_values(saved.pinned), learned]
        said += means(self.prior, self.samples, self.prior)
        return "; ".join(filter(None, [*said, *map(str, saved.condensed), *off]))

    @cached_property
    def misfits(self) -> tuple[Misfit, ...]:
        """The residuals for the samples of each name.

        They are compared with the noise, because there is no fit without bounds to compare them with.
        """
        every = zip(self.prior.names, self.prior.parts, self.samples, self.reference.kernel_sums, strict=True)
        return tuple(
            Misfit(name, of, residual(of, signal), noise * of.relative_noise, noise, noise, is_learned=False)
            for process, part, together, signal in every
            for noise in [float(part.noise_std)]
            for name, of in together.by_name(process).items()
        )
