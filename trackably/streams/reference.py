"""A reference learned window by window, with a proof of the whole.

It is saved with all data that it was learned from; when it is read, it is proved again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Self

from trackably.certificates.certificate import Certificate
from trackably.checker.certificate import AllTimes, TrueSignal
from trackably.files import LEFT_OUT, new_file
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.reference.condensed import Condensation
from trackably.reference.explanation import given_values, kept_free, means
from trackably.reference.fit import Misfit
from trackably.reference.saved import Saved, SavedTightening, window_of
from trackably.reference.trackable import LearnedReference
from trackably.reference.waypoints import Waypoint
from trackably.streams.windows import Stream
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening


@dataclass(frozen=True, eq=False)
class SavedStream(Saved):
    """A reference `learned` in windows of a `length` [s].

    The claim is the window from `proved_from` to `proved_until` [s], or all times if these are None.

    ValueError: there is not one prior, one learned signal and one set of samples for each flat output, a
    hyperparameter is not known, the length is not positive, or the claim has only one end or ends that do not increase.
    """

    learned: Reference
    samples: tuple[Samples, ...]
    prior: JointPrior
    length: float
    proved_from: float | None
    proved_until: float | None
    condensed: tuple[Condensation, ...] = field(default=(), metadata={LEFT_OUT: True})
    tightening: SavedTightening | None = field(default=None, metadata={LEFT_OUT: True})
    pinned: tuple[Waypoint, ...] = field(default=(), metadata={LEFT_OUT: True})
    truth: tuple[TrueSignal, ...] | None = field(default=None, metadata={LEFT_OUT: True})

    def __post_init__(self) -> None:
        super().__post_init__()
        counts = {len(self.samples), len(self.prior.parts), len(self.learned.kernel_sums)}
        if len(counts) > 1 or self.prior.learned or not self.length > 0:
            raise ValueError(
                "stream: expected as many samples as priors and learned signals (one of each for each flat output), "
                "no learned hyperparameters, and length > 0"
            )

    @property
    def reference(self) -> Reference:
        return self.learned

    @property
    def waypoints(self) -> tuple[Waypoint, ...]:
        return self.pinned

    @property
    def stream(self) -> Stream:
        """The stream that the reference was learned from."""
        claim = self.window or AllTimes()
        return Stream(self.samples, self.prior, self.learned.plant, self.length, claim, self.pinned)


@dataclass(frozen=True, eq=False, repr=False)
class StreamReference(LearnedReference):
    """One reference for a whole stream: the system can follow it at all times that `certificate` claims.

    The signals are one sum of kernels, to which each window has added, and the proof is about the sum; so there are no
    transitions between windows. `stream` holds the prior and the samples that were learned from, `condensed` the effect
    of replacing the given samples by fewer ones. `tightening` tells how the plant's bounds were tightened, for
    disturbances or by a margin; `reference` keeps the tightened bounds. `pin_certificates` prove the required values
    `stream.pinned`, in that order.
    """

    learned: Reference
    certificate: Certificate
    stream: Stream
    condensed: tuple[Condensation, ...] = ()
    tightening: Tightening | None = None
    pin_certificates: tuple[Certificate, ...] = ()

    @property
    def reference(self) -> Reference:
        """The reference itself, with values at all times."""
        return self.learned

    @property
    def samples(self) -> tuple[Samples, ...]:
        """The samples of the flat outputs; if they were condensed, the fewer ones that represent them."""
        return self.stream.samples

    @property
    def prior(self) -> JointPrior:
        """The prior of the flat outputs; hyperparameters are known, or learned from the window with most motion."""
        return self.stream.prior

    @property
    def explanation(self) -> str:
        """The proved statement, how the reference was learned, and its distance from the samples."""
        off = [
            f"it is {misfit.size:.3g} off the samples of {misfit.name} (root mean square), {misfit.in_noise:.3g} times "
            "their noise"
            for misfit in self.misfits
        ]
        learned = f"learned in windows of {self.stream.length:g} s, each of which continues the one before"
        said = [self.certificate.explanation, kept_free(self.tightening), *given_values(self.stream.pinned), learned]
        said += means(self.prior, self.samples, self.prior)
        return "; ".join(filter(None, [*said, *map(str, self.condensed), *off]))

    def save(self, path: Path | str) -> None:
        """Write everything as JSON, losslessly and atomically. Raises OSError."""
        stream, (start, end) = self.stream, window_of(self.certificate)
        tightening = SavedTightening.maybe(self.tightening)
        saved = SavedStream(
            self.learned,
            stream.samples,
            stream.prior,
            stream.length,
            start,
            end,
            self.condensed,
            tightening,
            stream.pinned,
            self.certificate.truth or None,
        )
        saved.write(new_file("save", path))

    @classmethod
    def _read(cls, path: Path) -> Callable[[], Self]:
        saved = SavedStream.read(path)
        return lambda: cls._proved_again(saved)

    @classmethod
    def _proved_again(cls, saved: SavedStream) -> Self:
        certificate, pinned = saved.proofs()
        return cls(saved.learned, certificate, saved.stream, saved.condensed, saved.computed_tightening, pinned)

    @cached_property
    def misfits(self) -> tuple[Misfit, ...]:
        """The residuals for the samples of each name.

        They are compared with the noise, because there is no fit without bounds to compare them with.
        """
        found = []
        each = zip(self.prior.names, self.prior.parts, self.samples, self.learned.kernel_sums, strict=True)
        for process, part, of, signal in each:
            for name, samples in of.by_name(process).items():
                off = samples.values - samples.stencil.measured(signal, samples.times)
                noise = float(part.noise_std)
                found.append(Misfit(name, samples, off, noise * samples.relative_noise, noise, noise, is_learned=False))
        return tuple(found)
