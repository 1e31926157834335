"""A learned reference as a file: the fit and the times of its proof, which is found again when it is read."""

from dataclasses import dataclass
from pathlib import Path
from typing import Self

from trackable.certificates.certificate import Certificate
from trackable.certificates.claim import OnWindow
from trackable.certificates.pinned import prove_pinned
from trackable.certificates.prove import Failure, prove, prove_on_window
from trackable.errors import InputError
from trackable.files import read_bytes, write_atomically
from trackable.fit import Fit


@dataclass(frozen=True, eq=False)
class SavedReference:
    """A file's content: `proved_from` and `proved_until` [s] for a window only. ValueError: these are no window."""

    fit: Fit
    proved_from: float | None
    proved_until: float | None

    @classmethod
    def of(cls, fit: Fit, certificate: Certificate) -> Self:
        claim = certificate.claim
        return cls(fit, *((claim.start, claim.end) if isinstance(claim, OnWindow) else (None, None)))

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a file. Raises InputError for one that holds a certificate or cannot be read, CodecError else."""
        from trackable.codec import loads  # noqa: PLC0415  loaded for files only
        from trackable.codec.certificates import FORMAT  # noqa: PLC0415  loaded for files only
        from trackable.codec.values import CodecError  # noqa: PLC0415  loaded for files only

        content = read_bytes(path)
        if f'"format": "{FORMAT}"'.encode() in content:
            raise InputError(f"{path}: holds a certificate; what can be loaded is the reference, as `save` writes it")
        try:
            return loads(cls, content)
        except CodecError as error:
            why = str(error).removeprefix("SavedReference: ")
            raise CodecError(f"{path}: is no saved reference, or damaged: {why}") from None

    def __post_init__(self) -> None:
        ends = self.proved_from, self.proved_until
        if (ends[0] is None) is not (ends[1] is None):
            raise ValueError(f"proved_from and proved_until: expected both or none, got {ends[0]} and {ends[1]}")
        if ends[0] is not None and ends[1] is not None and not ends[0] < ends[1]:
            raise ValueError(f"proved_from and proved_until: expected a window, got {ends[0]} and {ends[1]}")

    def write(self, path: Path) -> None:
        from trackable.codec import dumps  # noqa: PLC0415  loaded for files only

        write_atomically(path, dumps(self))

    def proofs(self) -> tuple[Certificate, tuple[Certificate, ...]] | Failure:
        """Prove again what was proved: the claim, and the values at each time that has some."""
        reference = self.fit.reference
        if self.proved_from is None or self.proved_until is None:
            found = prove(reference)
        else:
            found = prove_on_window(reference, self.proved_from, self.proved_until)
        if not isinstance(found, Certificate):
            return found
        pinned = prove_pinned(reference, self.fit.pinned)
        return (found, pinned) if isinstance(pinned, tuple) else pinned
