"""Files of saved references: the reference and the proved times. Loading a file proves the reference again."""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from pathlib import Path
from time import monotonic
from typing import Generic, Self, TypeVar

from trackably.arguments import real
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import as_written
from trackably.certificates.judge import found_or_raise
from trackably.certificates.prove import prove
from trackably.checker.certificate import TrueSignal, Window
from trackably.errors import InputError
from trackably.files import LEFT_OUT, read_bytes, write_atomically
from trackably.reference.fit import Fit
from trackably.reference.waypoints import Waypoint
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import DisturbanceSet, ModelError, Zonotope
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening, tightening
from trackably.work import BudgetEnded, until

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class SavedTightening:
    """The `given` plant and the parameters by which its bounds were tightened, and are tightened again on reading."""

    given: ConstrainedSystem
    margin: float
    disturbance: DisturbanceSet | None
    feedback: Array | None
    noise: Zonotope | None = field(default=None, metadata={LEFT_OUT: True})
    model_error: ModelError | None = field(default=None, metadata={LEFT_OUT: True})

    @classmethod
    def maybe(cls, found: Tightening | None) -> Self | None:
        if found is None:
            return None
        K = found.invariant.feedback if found.invariant else None
        return cls(found.given, found.margin, found.disturbance, K, found.noise, found.model_error)

    def found_again(self, plant: ConstrainedSystem) -> Tightening:
        """Return the tightening, computed again. ValueError: its bounds are not those of the reference's `plant`."""
        found = tightening(self.given, self.disturbance, self.feedback, self.margin, self.noise, self.model_error)
        if as_written(found.plant) != as_written(plant):
            raise ValueError(
                "tightening: it gives other bounds than those of the saved reference; was the file changed?"
            )
        return found


_SAVED_BY = {"fit": "TrackableReference", "learned": "StreamReference"}
"""The classes of saved references, by the first name in their files."""


class Saved(ABC):
    """The content of the file of a reference; subclasses say how the reference was found.

    `proved_from` and `proved_until` [s] are the ends of the proved window, or None if all times are proved. ValueError:
    only one of them is None, or they do not increase.
    """

    proved_from: float | None
    proved_until: float | None
    tightening: SavedTightening | None
    truth: tuple[TrueSignal, ...] | None

    @property
    @abstractmethod
    def reference(self) -> Reference:
        """The reference that was proved."""

    @property
    @abstractmethod
    def waypoints(self) -> tuple[Waypoint, ...]:
        """The values that the reference meets at given times."""

    @classmethod
    def read(cls, path: Path) -> Self:
        """Return the content of a file. InputError: it cannot be read, or holds something else.

        CodecError: it is no saved reference, or is damaged.
        """
        from trackably.codec import CodecError, loads  # noqa: PLC0415  loaded for files only

        content = read_bytes(path)
        if re.search(rb'"format": "track(ably|able) certificate"', content):
            raise InputError(f"{path}: expected a reference, as `save` writes it, got a certificate")
        for key, name in _SAVED_BY.items():
            if re.match(rf'\s*{{\s*"{key}"'.encode(), content) and key not in cls.__annotations__:
                raise InputError(f"{path}: is a {name}, which {name}.load reads")
        try:
            return loads(cls, content)
        except CodecError as error:
            why = str(error).removeprefix(f"{cls.__name__}: ")
            raise CodecError(f"{path}: is no saved reference, or damaged: {why}") from None

    def __post_init__(self) -> None:
        ends = self.proved_from, self.proved_until
        if (ends[0] is None) is not (ends[1] is None):
            raise ValueError(f"proved_from and proved_until: expected both or none, got {ends[0]} and {ends[1]}")
        _ = self.computed_tightening  # computed here, so that a wrong file is refused on reading
        if (window := self.window) and not window.start < window.end:
            raise ValueError(f"proved_from and proved_until: expected start < end, got {ends[0]} and {ends[1]}")

    @property
    def window(self) -> Window | None:
        """The proved window; None if all times are proved."""
        start, end = self.proved_from, self.proved_until
        return None if start is None or end is None else Window(start, end)

    @cached_property
    def computed_tightening(self) -> Tightening | None:
        """The tightening of the bounds; None if they were not tightened."""
        return None if self.tightening is None else self.tightening.found_again(self.reference.plant)

    def write(self, path: Path) -> None:
        from trackably.codec import dumps  # noqa: PLC0415  loaded for files only

        write_atomically(path, dumps(self))

    def proofs(self) -> tuple[Certificate, tuple[Certificate, ...]]:
        """Prove the claim and the required values again, and return the certificates of both.

        NotTrackableError: one of them is not proved.
        """
        found = found_or_raise(prove(self.reference, self.window))
        pinned = tuple(found_or_raise(at.prove(self.reference)) for at in self.waypoints)
        return replace(found.with_robust(self.computed_tightening), truth=self.truth or ()), pinned


@dataclass(frozen=True, repr=False)
class Unchecked(Generic[T]):
    """A reference that was read from `path`, but not checked within `seconds`, so that nothing is known about it.

    `check` checks it without a time limit, and returns the reference or raises the errors of `load`.
    """

    path: Path
    seconds: float
    check: Callable[[], T]

    @property
    def explanation(self) -> str:
        return (
            f"{self.path}: is unchecked after {self.seconds:g} s, so that nothing is known about the reference; call "
            "`check()` to check it without a time limit"
        )

    def __repr__(self) -> str:
        return f"Unchecked({self.explanation})"


def checked_within(seconds: float | None, path: Path, check: Callable[[], T]) -> T | Unchecked[T]:
    """Return what `check` returns, or Unchecked if that takes longer than `seconds`; None means no limit."""
    try:
        with until(inf if seconds is None else monotonic() + real("load: seconds", seconds)):
            return check()
    except BudgetEnded:
        return Unchecked(path, seconds or 0.0, check)


def window_of(certificate: Certificate) -> tuple[float, float] | tuple[None, None]:
    """Return the first and the last time [s] of a claim on a window; (None, None) for other claims."""
    claim = certificate.claim
    return (claim.start, claim.end) if isinstance(claim, Window) else (None, None)


@dataclass(frozen=True, eq=False)
class SavedReference(Saved):
    """A saved fit, with the proved times and the `truth` that was given."""

    fit: Fit
    proved_from: float | None
    proved_until: float | None
    tightening: SavedTightening | None = field(default=None, metadata={LEFT_OUT: True})
    truth: tuple[TrueSignal, ...] | None = field(default=None, metadata={LEFT_OUT: True})

    @classmethod
    def of(cls, fit: Fit, certificate: Certificate, tightening: Tightening | None) -> Self:
        start, end = window_of(certificate)
        return cls(fit, start, end, SavedTightening.maybe(tightening), certificate.truth or None)

    @property
    def reference(self) -> Reference:
        return self.fit.reference

    @property
    def waypoints(self) -> tuple[Waypoint, ...]:
        return self.fit.pinned
