"""Files of saved references: the reference and the proved times. Loading a file proves the reference again."""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from time import monotonic
from typing import Generic, Self, TypeVar

from trackably.arguments import real
from trackably.certificates.certificate import Certificate
from trackably.certificates.claim import as_claim
from trackably.certificates.form import as_written
from trackably.certificates.judge import found_or_raise
from trackably.certificates.prove import prove
from trackably.checker.certificate import Claim, TrueSignal
from trackably.errors import InputError
from trackably.files import read_bytes, write_atomically
from trackably.reference.fit import Fit
from trackably.reference.waypoints import Waypoint
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening
from trackably.work import BudgetEnded, until

T = TypeVar("T")


_SAVED_BY = {"fit": "TrackableReference", "learned": "StreamReference"}
"""The classes of saved references, by a name that only their files have."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Saved(ABC):
    """What is known of a reference, as its file has it; subclasses add what was learned.

    `proved_from` and `proved_until` [s] are the ends of the proved window, or None if all times are proved. The bounds
    of the plant were tightened as `tightening` says. ValueError: the window does not end after it begins, or the plant
    has other bounds than `tightening` gives.
    """

    proved_from: float | None
    proved_until: float | None
    tightening: Tightening | None = None
    truth: tuple[TrueSignal, ...] | None = None

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
            if re.search(rf'^  "{key}":'.encode(), content, re.MULTILINE) and key not in cls.__annotations__:
                raise InputError(f"{path}: is a {name}, which {name}.load reads")
        try:
            return loads(cls, content)
        except CodecError as error:
            why = str(error).removeprefix(f"{cls.__name__}: ")
            raise CodecError(f"{path}: is no saved reference, or damaged: {why}") from None

    def __post_init__(self) -> None:
        _ = self.window  # computed here, so that a wrong file is refused on reading
        if self.tightening and as_written(self.tightening.plant) != as_written(self.reference.plant):
            raise ValueError(
                "tightening: it gives other bounds than those of the saved reference; was the file changed?"
            )

    @property
    def window(self) -> Claim | None:
        """The proved window; None if all times are proved."""
        ends = self.proved_from, self.proved_until
        return None if ends == (None, None) else as_claim(ends)

    def write(self, path: Path) -> None:
        from trackably.codec import dumps  # noqa: PLC0415  loaded for files only

        write_atomically(path, dumps(self))

    def proofs(self) -> tuple[Certificate, tuple[Certificate, ...]]:
        """Prove the claim and the required values again, and return the certificates of both.

        NotTrackableError: one of them is not proved.
        """
        found = found_or_raise(prove(self.reference, self.window))
        pinned = tuple(found_or_raise(at.prove(self.reference)) for at in self.waypoints)
        return replace(found.with_robust(self.tightening), truth=self.truth or ()), pinned


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


@dataclass(frozen=True, eq=False)
class SavedReference(Saved):
    """A saved `fit`: a reference with what was learned about it."""

    fit: Fit

    @property
    def reference(self) -> Reference:
        return self.fit.reference

    @property
    def waypoints(self) -> tuple[Waypoint, ...]:
        return self.fit.pinned
